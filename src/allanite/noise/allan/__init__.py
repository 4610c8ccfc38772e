# SPDX-License-Identifier: BSD-3-Clause
"""Allan statistics: the curve, its exact covariance, its degrees of freedom.

``curve``       AllanCurve and allan_curve(recording): what a user calls.
``statistics``  the members of the family; those that are one sum over the phase.
``theo``        Theo1, TheoBR and ThêoH: up to three quarters of the record.
``robust``      an M-estimate of the Allan variance, and its degrees of freedom.
``lags``        which lags: octave, decade, all, per decade, or an array.
``covariance``  exact finite-sample mean, covariance and edf under a model.
``cells``       the variance window by window of time, with the covariance of all windows.
``online``      one pass in fixed memory; ``live`` the curve of a record that is still being made.
``matrix``      Allan covariance of several channels.
``theo_covariance``  mean, bias and edf of Theo1 under a model.
``degrees``     intervals from degrees of freedom; published formulas of the others.
``local_degrees``  edf of a curve alone, from its local power law.
"""

from allanite.noise.allan.curve import AllanCurve, allan_curve

__all__ = ["AllanCurve", "allan_curve"]
