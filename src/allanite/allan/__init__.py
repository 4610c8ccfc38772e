# SPDX-License-Identifier: BSD-3-Clause
"""Allan statistics: the curve, its exact covariance, its degrees of freedom.

``curve``       AllanCurve and allan_curve(recording): what a user calls.
``statistics``  the seven statistics as sums over the phase.
``lags``        which lags: octave, decade, all, per decade, or an array.
``covariance``  exact finite-sample mean, covariance and edf under a model.
``degrees``     edf and intervals of a curve alone, from its local power law.
"""

from allanite.allan.curve import AllanCurve, allan_curve

__all__ = ["AllanCurve", "allan_curve"]
