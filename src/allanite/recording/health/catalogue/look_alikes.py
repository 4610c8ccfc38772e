# SPDX-License-Identifier: BSD-3-Clause
"""What each finding may be mistaken for, and what tells the two apart."""

from __future__ import annotations

__all__ = ["LOOK_ALIKES"]

#: Code -> what shows the same at first sight; what tells them apart.
LOOK_ALIKES: dict[str, tuple[str, str]] = {
    "no_samples": (
        "the wrong column",
        "the channel has only empty cells: the error lists other channels",
    ),
    "too_short": (
        "a log cut by `--from`, `--to`",
        "the count is that of the requested part",
    ),
    "rows_of_means": (
        "a short log of a tumbling unit",
        "stamps: rows at intervals below 5 s are samples",
    ),
    "broken_up": (
        "samples lost at random; two alternating sensors",
        "values at an even spacing of rows are two sensors: the spacing is stated, and the repair uses it",
    ),
    "missing": (
        "zeros and fill values instead of lost samples",
        "those are `zero_filled` and `fill_value`; here the cells are empty",
    ),
    "overload": (
        "a very large reading",
        "no instrument has readings of 9.9E37 and above",
    ),
    "saturated": (
        "clipping inside the range; a level near a power of two",
        "only the last code of an integer word counts, and it repeats or is over 6 sigma from the mean",
    ),
    "clipping": (
        (
            "a log with few levels; zeros or fill values; a vibration, whose density rises at its ends; a "
            "frozen reading"
        ),
        (
            "at most eight levels are `quantisation`; a single value far from all others is a code; "
            "counts that fall outward and jump at the end are clipping, steadily rising counts are not; a "
            "run counts once"
        ),
    ),
    "implausible_exponents": (
        "overload words; a drift over decades",
        "90 % of the magnitudes span over 60 powers of two; then nothing else is reported",
    ),
    "only_grows": (
        "a strong drift; an accumulated angle with its unit",
        (
            "half of the steps of noise are negative: 98 % have the same sign only if the drift is three "
            "sigma per sample; an angle is identified by its unit"
        ),
    ),
    "no_noise_resolved": (
        "a log that froze at its first sample",
        "none: both are constant",
    ),
    "quantisation_limited": (
        "values held for several rows; an outlier that hides the step",
        "held values change by many steps; values beyond a thousand spreads are ignored in finding the step",
    ),
    "quantisation": (
        "a time column, with its even steps; the step of float32 numbers",
        "a time is `only_grows`; a step that grows with the level is `float_step`",
    ),
    "quantisation_not_white": (
        "an angle that does not change",
        "the increments vary by less than 0.55 steps",
    ),
    "resolution_step": (
        "roundings of scaled counts",
        "values closer than eight roundings are equal",
    ),
    "float_step": (
        "the step of a converter",
        "it equals the spacing of the number type at the median of the samples",
    ),
    "stuck": (
        "coarse steps, which repeat by chance; held values; a tail of zeros",
        (
            "the longest run by chance with these steps is stated; held values repeat throughout; zeros "
            "far from the level are `zero_filled`. A coarse axis counts as frozen where the others froze"
        ),
    ),
    "zero_filled": (
        "coarse steps with 0 among them; a signal about zero; a dead band",
        (
            "0 must be isolated: over 8 sigma from the level, with at least two unused steps next to it; "
            "near a zero level only rows that are 0 in all channels count, if ten times as many as by chance"
        ),
    ),
    "fill_value": (
        "the end of a range that knocks reach; two alternating levels",
        (
            "one exact value, at least three times, far from all others. Knocks that always end at the "
            "same value look the same, and are not readings either"
        ),
    ),
    "held_samples": (
        "a frozen stretch; coarse steps; motion, which changes how often neighbors are equal",
        (
            "frozen stretches are left out first; repeats from coarse steps have no regular rate, those "
            "of a slower sensor do"
        ),
    ),
    "interleaved": (
        "one spike or a wild first row; a step, a ramp; a line near half the rate",
        (
            "90 % of all pieces of the record must show the same order of levels, each about the moving "
            "mean and with its extremes trimmed: a spike is in one piece, a line changes phase. A line "
            "locked to a whole fraction of the rate looks the same"
        ),
    ),
    "half_before_gap": (
        "noise before a gap",
        "half the level within four standard errors, or a quarter of the power",
    ),
    "duplicate_channels": (
        "axes that move together",
        "the ratio is the same to 1e-9 in every sample",
    ),
    "time_stamps": (
        "jitter",
        "a backward step, or equal stamps, are not jitter",
    ),
    "duplicate_stamps": (
        "coarse stamps",
        "the surrounding stamps are finer than the interval",
    ),
    "rate_jitter": (
        "lost samples",
        "a pause is a gap: stamps after it keep their place",
    ),
    "rate_not_median": (
        "a wrong rate",
        "the count over the span decides",
    ),
    "clock_rate": (
        "lost samples",
        "a rate from counts, with gaps in their places",
    ),
    "off_grid": (
        "a clock that drifts",
        "a clock that drifts by 500 ppm over 4096 samples is allowed for",
    ),
    "clock_drift": (
        "jitter of the stamps",
        "the drift exceeds it by five standard errors, or reaches half an interval in medians of many stamps",
    ),
    "decimated": (
        "a clock with the wrong rate",
        "the ratio is a whole number within 1 %",
    ),
    "coarse_stamps": (
        "duplicate stamps",
        "the steps of the stamps are wider than the sample interval",
    ),
    "no_time_stamps": (
        "stamps set aside by `--rate`",
        "the message names the source of the rate",
    ),
    "ragged_rows": (
        "a truncated last line",
        "that one is counted separately",
    ),
    "cells_missing": (
        "a word for overload",
        "overload words are counted separately",
    ),
    "unterminated_last_line": (
        "a short last row",
        "the line has no line end",
    ),
    "nul_bytes": (
        "a binary file",
        "a binary file has no rows",
    ),
    "dialect_guessed": (
        "none",
        "every guess is listed",
    ),
    "repaired": (
        "none",
        "it was requested",
    ),
    "bench_file": (
        "none",
        "it was read",
    ),
    "gap_reasons": (
        "none",
        "the recorder noted it",
    ),
    "doubtful_samples": (
        "none",
        "the recorder noted it",
    ),
    "instrument_remarks": (
        "none",
        "the recorder noted it",
    ),
    "autozero_off": (
        "none",
        "the settings of the meter state it",
    ),
    "scale_uncertain": (
        "none",
        "it was stated",
    ),
    "spikes": (
        "noise with heavy tails; a knock that rings; a step of the level",
        "few, in short bursts, further out than the tails of the other samples reach; a step is permanent",
    ),
    "heavy_tails": (
        "spikes; a disturbance",
        "too many for isolated impulses, or no further out than the tails of the other samples reach",
    ),
    "contaminated": (
        "spikes; noise that changes; coarse steps; Student or Laplace noise",
        (
            "a mixture of two spreads must be more likely than each of these distributions, and the wide "
            "samples must not cluster and must be evenly distributed over the record"
        ),
    ),
    "disturbance": (
        "drift and flicker; spikes; a change of the noise",
        (
            "differences of block means are insensitive to drift; spikes are removed first; a window must "
            "exceed four times the quiet power. Noise temporarily up to five times larger, by the same "
            "factor at every lag, is `noise_changes`"
        ),
    ),
    "not_at_rest": (
        "a disturbance",
        "over 17 times the deviation of the quiet parts at some lag",
    ),
    "motion": (
        "drift of an accelerometer's bias",
        "2 deg are 34 mg: no bias drifts that far",
    ),
    "amplitude_drop": (
        "a frozen or held stretch",
        "those are left out first; the power is below half, not 0",
    ),
    "noise_changes": (
        "a disturbance; chance",
        (
            "a chi-square test of the parts of the record, one false alarm in 10 000 records; no window "
            "exceeds the sample-to-sample noise around it"
        ),
    ),
    "unit_missing": (
        "none",
        "the file names no unit",
    ),
    "counts": (
        "none",
        "the unit is LSB",
    ),
    "gravity": (
        "an accelerometer triad in motion",
        "if the unit turned, its most typical second counts; constant motion gives no finding; mix-ups are named",
    ),
    "unit_trap": (
        "a vibrating gyro",
        "the quiet windows decide, and a ratio of 57.3 is reported",
    ),
    "bias_removed": (
        "a good gyro perpendicular to the Earth's axis; a simulated record",
        "two axes of a triad, by chance in one record of 100",
    ),
    "floor_taken_off": (
        "none",
        "it was requested",
    ),
    "floor_dominates": (
        "a sensor quieter than its instrument",
        "none: this is the same",
    ),
    "aliasing": (
        "none",
        "the aperture is stated by the file or by the user",
    ),
    "spectral_line": (
        "a narrow resonance",
        "a steady line is as wide as the record allows",
    ),
    "lag_and_frequency_disagree": (
        "a poor fit",
        "the curve is fitted well, but the spectrum disagrees",
    ),
    "short_lags_left_out": (
        "quantisation",
        "no sum of noise terms has that slope",
    ),
    "model_discrepancy": (
        "intervals that are too small",
        "a test of the curve with its own covariance",
    ),
    "not_fitted": (
        "none",
        "the reasons are listed",
    ),
    "band_limited": (
        "held values",
        "the spectrum falls smoothly, no value repeats",
    ),
    "environment_taken_off": (
        "none",
        "it was requested",
    ),
    "temperature_not_resolved": (
        "a drift of the sensor",
        "a monotonic temperature is not separable from time",
    ),
    "hysteresis": (
        "a lag of the sensor behind its temperature",
        "the branches differ at the same temperature by more than a lag explains",
    ),
    "warm_up": (
        "a random walk; a ramp",
        "a test of the exponential against the fitted noise",
    ),
    "turns_by_size": (
        "knocks of equal size",
        "angles near half a turn, accelerometers that change sign with them, or the list of turns",
    ),
    "turns_by_rhythm": (
        "knocks in step with the turns",
        "none but the list of turns",
    ),
    "turn_unlike": (
        "a half turn with a wrong scale",
        "the other turns have the right angle",
    ),
    "turns_clipped": (
        "short turns",
        "samples at the end of the range",
    ),
    "turn_missed": (
        "a planned long dwell",
        "the list of turns",
    ),
    "turn_doubled": (
        "a knock",
        "the list of turns",
    ),
    "turn_hidden": (
        "a gap without a turn",
        "the direction after it",
    ),
    "direction_unknown": (
        "a gap without a turn",
        "the levels on both sides",
    ),
    "gap_without_turn": (
        "a hidden turn",
        "the levels on both sides",
    ),
    "dwell_disturbed": (
        "a turn",
        "it leaves no net angle",
    ),
    "dwell_stuck": (
        "coarse steps",
        "as for `stuck`",
    ),
    "turn_not_listed": (
        "a knock",
        "its angle",
    ),
    "turn_not_seen": (
        "a wrong time in the list",
        "the nearest motion in the signal",
    ),
    "checksum_failed": (
        "sentences of another type",
        "only lines with a checksum are checked",
    ),
    "labeled_lines": (
        "messages of the logger between its samples",
        "only lines with two or more of the log's labels must match its form",
    ),
    "cell_suffix": (
        "words; a second delimiter",
        "most cells of the column begin with a number",
    ),
    "sensor_left_out": (
        "a column of remarks",
        "only names and units of an axis of a gyro or an accelerometer count",
    ),
    "raw_counts": (
        "readings that were rounded to whole numbers",
        "a step of 1 without a unit, in the range of a 16-bit word; gravity gives the range of an accelerometer",
    ),
}
