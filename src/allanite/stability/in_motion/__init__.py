# SPDX-License-Identifier: BSD-3-Clause
"""Noise in motion: how much a log with motors on, or carried, holds over a log at rest.

``estimation``  measure_in_motion(rest, motions): what a user calls.
``lines``       new lines, harmonics of one rotation, aliases.
``told``        the noise model for a filter.
``matching``    which channels belong together.
``results``     InMotion and what it is made of; ``words`` says it in a sentence.
"""

from allanite.stability.in_motion.estimation import measure_in_motion
from allanite.stability.in_motion.results import BandInflation, ChannelInMotion, InMotion, MotionVerdict

__all__ = ["BandInflation", "ChannelInMotion", "InMotion", "MotionVerdict", "measure_in_motion"]
