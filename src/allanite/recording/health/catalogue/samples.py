# SPDX-License-Identifier: BSD-3-Clause
"""Faults of the samples themselves: missing, out of range, coarse, repeated."""

from __future__ import annotations

from allanite.recording.health.catalogue.entry import FindingKind

__all__ = ["BY_SAMPLES", "SAMPLES"]

_MISSING, _RANGE, _STEPS, _REPEATS = ("Missing samples", "Range", "Resolution", "Repeated samples")

#: What to do where samples are missing everywhere.
BY_SAMPLES = "fit the samples instead of the curve: allanite characterize LOG --method likelihood"

SAMPLES: dict[str, FindingKind] = {
    "no_samples": FindingKind(
        group=_MISSING,
        severity="fatal",
        means="a channel has no samples",
        risk="there is nothing to analyze; accepted, the channel is left out",
        done="refused",
        advice="choose other channels, or look for the fault in the log",
    ),
    "too_short": FindingKind(
        group=_MISSING,
        severity="fatal",
        means="fewer samples than a noise model needs",
        risk="intervals as wide as the estimates; terms cannot be distinguished",
        done="refused",
        advice="record longer",
    ),
    "rows_of_means": FindingKind(
        group=_MISSING,
        severity="fatal",
        means="a table with one row per position: few rows, with gravity of equal magnitude in many directions",
        risk="the changes between positions are treated as noise",
        done="refused",
        advice="if each row is the mean of one position, use --means of calibrate, align or north",
    ),
    "broken_up": FindingKind(
        group=_MISSING,
        severity="fatal",
        means="no stretch without a missing sample is long enough; often two sensors share the rows of one log",
        risk="almost no average fits between the gaps, so the curve rests on a few samples or is empty",
        done="refused, except by the likelihood fit, `filter` and `select` if samples are missing at random",
        advice="if there is a value in every k-th row, keep these rows",
        repair="split_interleaved",
    ),
    "missing": FindingKind(
        group=_MISSING,
        severity="info, warning",
        means="samples are missing (NaN, empty cells, gaps in the time stamps)",
        risk="fewer averages at lags longer than the unbroken stretches",
        done="left as gaps: nothing is filled in, and no average spans them",
        advice="none needed; if the curve ends too early: allanite characterize LOG --method likelihood "
        "uses all samples",
    ),
    "overload": FindingKind(
        group=_RANGE,
        severity="warning, fatal",
        means="overload words (9.9E37, 9.91E37, 1E38, infinity): the instrument was out of range",
        risk="the signal while out of range is unknown, and recovery is slow: the samples after it may be biased",
        done="left out; fatal above 0.1 % of the samples",
        advice="choose a wider range, or find what drove the sensor out of range",
        excludes=True,
        repair="drop_saturated",
    ),
    "saturated": FindingKind(
        group=_RANGE,
        severity="warning, fatal",
        means="the extreme code of an integer word (32767, -32768, 65535, ...) is far from all other "
        "values, or repeats",
        risk="a code for 'out of range' is treated as a value: one is enough to raise the whole curve",
        done="left out; fatal above 0.1 % of the samples",
        advice="choose a wider range",
        excludes=True,
        repair="drop_saturated",
    ),
    "clipping": FindingKind(
        group=_RANGE,
        severity="warning, fatal",
        means="too many samples have the extreme value, compared with its neighbors: the range ends there",
        risk="N is too small, by 28 % if clipped at one standard deviation",
        done="kept unchanged; fatal if the range ends within about 3 standard deviations",
        advice="choose a wider range and record again",
    ),
    "implausible_exponents": FindingKind(
        group=_RANGE,
        severity="fatal",
        means="the values span tens of powers of ten, unlike those of any sensor: wrong byte order or wrong type",
        risk="the numbers are not the sensor's",
        done="refused",
        advice="read the file again with the other byte order or another number type",
    ),
    "only_grows": FindingKind(
        group=_RANGE,
        severity="fatal",
        means="the values only increase, or only decrease: a time, a counter or an accumulated quantity",
        risk="the numbers describe a clock or a counter, not the noise of a sensor",
        done="refused",
        advice="choose the channels with readings: --channels; state the unit of an accumulated angle: --unit",
    ),
    "no_noise_resolved": FindingKind(
        group=_STEPS,
        severity="fatal",
        means="all samples are equal: the noise is below the resolution, or the channel is dead",
        risk="a deviation of exactly 0, which is not that of the sensor",
        done="refused",
        advice="raise the gain or the number of digits; check the wiring",
    ),
    "quantisation_limited": FindingKind(
        group=_STEPS,
        severity="fatal",
        means="the sample-to-sample noise is less than half a step of the values",
        risk="N is that of the converter: 0 or several times too large, depending on the level between two steps",
        done="refused. Of increments of an angle or a velocity (pulses of a fiber-optic gyro), the angle is rounded: "
        "accepted, `characterize` fits them as `quantisation_not_white` says",
        advice="raise the gain or log more digits; averages long enough to cross many steps are less affected",
    ),
    "quantisation": FindingKind(
        group=_STEPS,
        severity="warning",
        means="the step of the values is more than half the sample-to-sample noise",
        risk="N includes the quantization noise of the step",
        done="kept; the share is stated. This noise is white: it adds to N, not to Q",
        advice="log more digits or raise the gain",
    ),
    "quantisation_not_white": FindingKind(
        group=_STEPS,
        severity="warning",
        means="an angle advances by too regular a fraction of its step: the rounding errors follow a pattern",
        risk="a fit of all lags gives a wrong N (0.6 to 1.1 times) and Q (0.3 to 1.6 times); lines appear in the "
        "spectrum",
        done="kept; `characterize` fits the curve from the lag at which the noise moves the angle by 0.7 step",
        advice="do not read Q as step/sqrt(12); record finer angles",
    ),
    "resolution_step": FindingKind(
        group=_STEPS,
        severity="info",
        means="the values are multiples of a step; the step and its ratio to the noise are stated",
        risk="",
        done="kept; harmless",
        advice="none needed",
    ),
    "float_step": FindingKind(
        group=_STEPS,
        severity="warning",
        means="the level is so large that the spacing of floating-point numbers exceeds a tenth of the noise",
        risk="the rounding adds to N; at twice the noise it replaces it",
        done="kept; the share is stated",
        advice="subtract the level before storing, or store float64",
    ),
    "stuck": FindingKind(
        group=_REPEATS,
        severity="warning, fatal",
        means="one value repeats longer than by chance (once in 10 000 records): a frozen reading",
        risk="steps at both ends raise the curve, and the flat part lowers it",
        done="left out; fatal if more than half of the samples are affected",
        advice="find why the reading froze",
        excludes=True,
        repair="drop_padding",
    ),
    "zero_filled": FindingKind(
        group=_REPEATS,
        severity="warning, fatal",
        means="exact zeros far from the level, or in all channels simultaneously: lost samples written as 0",
        risk="1000 zeros at a level of 20 sigma raise the curve five times",
        done="left out; fatal if more than half of the samples are affected",
        advice="write lost samples as empty cells",
        excludes=True,
        repair="drop_padding",
    ),
    "fill_value": FindingKind(
        group=_REPEATS,
        severity="warning, fatal",
        means="a value far from all others recurs: a code for 'no value' (-999, 9999)",
        risk="a code is treated as a value: a few raise the whole curve",
        done="left out; fatal if more than half of the samples are affected",
        advice="write lost samples as empty cells",
        excludes=True,
        repair="drop_padding",
    ),
    "held_samples": FindingKind(
        group=_REPEATS,
        severity="warning",
        means="samples repeat: the sensor updates more slowly than the log",
        risk="the deviation at the shortest lags is too small, and N is too large if some values count "
        "more often than others",
        done="`characterize` uses each value once, at the sensor's rate, if that is steady and neither a "
        "floor nor the environment is requested; otherwise kept",
        advice="use each value once",
        repair="drop_repeats",
    ),
    "interleaved": FindingKind(
        group=_REPEATS,
        severity="warning, fatal",
        means="rows k, 2k, ... differ from the rows between them in level or in noise: two sensors in one column",
        risk="the difference between the sensors looks like noise at the shortest lags",
        done="kept; fatal if the levels differ by more than 3 sigma",
        advice="split the log by sensor",
        repair="split_interleaved",
    ),
    "half_before_gap": FindingKind(
        group=_REPEATS,
        severity="warning",
        means="just before a gap the level or the noise is half of that elsewhere: a truncated block",
        risk="a step at each gap raises the curve",
        done="left out",
        advice="discard the last block before each gap when logging",
        excludes=True,
        repair="drop_cut_blocks",
    ),
    "duplicate_channels": FindingKind(
        group=_REPEATS,
        severity="warning",
        means="two channels hold the same samples, or one is a fixed multiple of the other",
        risk="one of them has the wrong name, and their agreement proves nothing",
        done="kept",
        advice="check which column belongs to which axis",
    ),
}
