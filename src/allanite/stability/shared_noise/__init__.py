# SPDX-License-Identifier: BSD-3-Clause
"""Two or three sensors recorded together: the noise of each without the part that they share, and that part.

    y_i = c + e_i,    C_ij(tau) = <D_i D_j>/2,    D = difference of adjacent means over tau.                         (1)

Two sensors: C_12 is the Allan variance of the common part c, C_11 - C_12 that of e_1 (Allan cross-covariance).
Three: C_11 - C_12 - C_13 + C_23 is that of e_1, whatever all three share (three-cornered hat).

``estimation``  separate_noise(recording): what a user calls.
``quadratic``   which combination of C estimates which part, and its exact variance.
``fiducial``    intervals that hold where an estimate comes out negative.
``terms``       noise terms of every part, by generalised least squares in the exact covariance.
``agreement``   do all three share the same part? does one of them feel it later?
``results``     Separation and what it is made of; ``verdict`` what it may come to, ``words`` says it in a sentence.
"""

from allanite.stability.shared_noise.estimation import separate_noise
from allanite.stability.shared_noise.results import NoisePart, Separation
from allanite.stability.shared_noise.verdict import SeparationVerdict

__all__ = ["NoisePart", "Separation", "SeparationVerdict", "separate_noise"]
