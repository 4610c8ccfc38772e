# SPDX-License-Identifier: BSD-3-Clause
"""Lags of an angle that are too short for its noise to cross a step: rounding errors with a pattern rule them.

A fiber-optic gyro counts pulses of an angle. While the noise moves the angle by much less than a pulse, the rounding
errors depend on the rate alone, and their Allan variance is not 3 Q^2/tau^2. Over longer times the noise dithers them,
and they are white again.
"""

from __future__ import annotations

import numpy as np

from allanite.noise.allan.curve import AllanCurve
from allanite.noise.spectrum.exclusion import Exclusion
from allanite.recording.health.resolution import patterned_step
from allanite.recording.records import Recording

__all__ = ["without_rounded_lags"]

#: Allan variance times tau^2, in steps^2, from which a lag is used: white rounding errors give 1/4, and a noise of
#: 0.7 step, which dithers them, the rest.
_DITHERED = 0.75


def without_rounded_lags(
    exclusion: Exclusion, curve: AllanCurve, recording: Recording, name: str
) -> Exclusion:
    """The exclusion with the lags below the last at which the angle moves by less than its step.

    Parameters
    ----------
    curve : AllanCurve
        Of one channel.
    recording : Recording
    name : str
        Of an angle or a velocity, or of its increments; any other channel keeps its lags.
    """
    step = patterned_step(recording, name)
    if step == 0.0:
        return exclusion
    held = curve.tau**2 * curve.variance[:, 0] < _DITHERED * step**2
    out = np.arange(len(held)) <= np.max(np.flatnonzero(held), initial=-1)
    reasons = tuple(
        r or ("the angle moves less than its step" if o else "")
        for r, o in zip(exclusion.reasons, out, strict=True)
    )
    return Exclusion(exclusion.excluded | out, reasons)
