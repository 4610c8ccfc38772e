# SPDX-License-Identifier: BSD-3-Clause
"""Kalman filter, smoother and their tests, for any StateSpace and for recordings with a noise model."""

from allanite.kalman.consistency import Consistency, consistency
from allanite.kalman.filtered import Filtered, TermSeries, filter_recording
from allanite.kalman.filtering import FilterResult, FilterRun, Form, log_likelihood, run_filter
from allanite.kalman.smoothing import Smoothed, smooth
from allanite.kalman.steady import SteadyState, merged, steady_state

__all__ = [
    "Consistency",
    "FilterResult",
    "FilterRun",
    "Filtered",
    "Form",
    "Smoothed",
    "SteadyState",
    "TermSeries",
    "consistency",
    "filter_recording",
    "log_likelihood",
    "merged",
    "run_filter",
    "smooth",
    "steady_state",
]
