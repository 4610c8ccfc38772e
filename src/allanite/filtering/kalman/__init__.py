# SPDX-License-Identifier: BSD-3-Clause
"""Kalman filter, smoother and their tests, for any StateSpace and for recordings with a noise model."""

from allanite.filtering.kalman.consistency import Consistency, FilterVerdict, consistency
from allanite.filtering.kalman.estimate import FilterConditions, FilterEstimate, FilterRemark, TermSeries
from allanite.filtering.kalman.filtered import Filtered, filter_recording
from allanite.filtering.kalman.filtering import FilterResult, FilterRun, Form, log_likelihood, run_filter
from allanite.filtering.kalman.smoothing import Smoothed, smooth
from allanite.filtering.kalman.steady import SteadyState, merged, steady_state

__all__ = [
    "Consistency",
    "FilterConditions",
    "FilterEstimate",
    "FilterRemark",
    "FilterResult",
    "FilterRun",
    "FilterVerdict",
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
