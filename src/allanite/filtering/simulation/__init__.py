# SPDX-License-Identifier: BSD-3-Clause
"""Records of a sensor whose truth is known: noise, motion and the Earth.

``record``      simulate(model, rate, duration, seed, motion): what a user calls.
``motion``      Motion: what the operator means to do with the sensor, and how badly.
``course``      what a motion becomes in one record: headings and rotation over time, and their exact means.
``signal``      what a sensor would show without noise: Earth, rotation, bias, warm-up, temperature.
``unit``        simulate_unit(models, rate, motion, latitude, seed): three gyros and three accelerometers.
``unit_motion`` UnitMotion: the attitudes that a unit is set to, or its rotation.
``unit_course`` what that becomes in one record: attitude over time, and the exact means of what the triads see.
"""

from allanite.filtering.simulation.motion import Motion
from allanite.filtering.simulation.record import simulate
from allanite.filtering.simulation.signal import Temperature
from allanite.filtering.simulation.unit import simulate_unit, true_attitudes
from allanite.filtering.simulation.unit_motion import UnitMotion

__all__ = ["Motion", "Temperature", "UnitMotion", "simulate", "simulate_unit", "true_attitudes"]
