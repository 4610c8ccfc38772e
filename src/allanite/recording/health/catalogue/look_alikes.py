# SPDX-License-Identifier: BSD-3-Clause
"""What each finding may be mistaken for, and what tells the two apart."""

from __future__ import annotations

__all__ = ["LOOK_ALIKES"]

#: Code -> what shows the same at first sight; what tells them apart.
LOOK_ALIKES: dict[str, tuple[str, str]] = {
    "no_samples": (
        "the wrong column",
        "nothing but empty cells is in the channel: other channels are listed with it",
    ),
    "too_short": (
        "a log cut by `--from`, `--to`",
        "the count is that of the part that was asked for",
    ),
    "rows_of_means": (
        "a short log of a unit that tumbles",
        "stamps: rows that come faster than one in 5 s are samples",
    ),
    "broken_up": (
        "samples lost at random; two sensors that take turns",
        "values at an even spacing of rows are two sensors: the spacing is stated, and the repair keeps it",
    ),
    "missing": (
        "zeros and fill values in place of lost samples",
        "those are `zero_filled` and `fill_value`; here nothing is written",
    ),
    "overload": (
        "a very large reading",
        "at 9.9E37 and above no instrument has a reading",
    ),
    "saturated": (
        "clipping inside the range; a level near a power of two",
        "only the last code of an integer word counts, and it repeats or is over 6 sigma from the mean",
    ),
    "clipping": (
        (
            "a log of few levels; zeros or fill values; a vibration, whose density rises at its ends; a frozen "
            "reading"
        ),
        (
            "at most eight levels are `quantisation`; a value that stands alone far from all others is a word; "
            "counts that fall outwards and jump at the end are a clip, counts that rise all along are not; a run "
            "counts once"
        ),
    ),
    "implausible_exponents": (
        "overload words; a drift over decades",
        "nine tenths of the magnitudes span over 60 powers of two; then nothing else is reported",
    ),
    "only_grows": (
        "a strong drift; an accumulated angle with its unit",
        (
            "of noise one step in two is negative: 98 % have one sign only where the drift is three sigma per "
            "sample; an angle is an angle by its unit"
        ),
    ),
    "no_noise_resolved": (
        "a log that froze at its first sample",
        "none: both are one value throughout",
    ),
    "quantisation_limited": (
        "values held for several rows; one wild value that blurs the step",
        "held values change by many steps at once; values beyond a thousand spreads do not tell the step",
    ),
    "quantisation": (
        "a time column, whose steps are even; the step of float32 numbers",
        "a time is `only_grows`; a step that grows with the level is `float_step`",
    ),
    "quantisation_not_white": (
        "an angle that does not change",
        "the increments vary by less than 0.55 steps",
    ),
    "resolution_step": (
        "roundings of scaled counts",
        "values closer than eight roundings are one",
    ),
    "float_step": (
        "the step of a converter",
        "it is that of the number type at the median of the samples",
    ),
    "stuck": (
        "coarse steps, which repeat by chance; held values; a tail of zeros",
        (
            "the longest run that chance makes of these steps is stated; held values repeat alike all along; "
            "zeros far from the level are `zero_filled`. A coarse axis counts as frozen where the others froze"
        ),
    ),
    "zero_filled": (
        "coarse steps with 0 among them; a signal about zero; a dead band",
        (
            "0 must stand alone: over 8 sigma from the level, with at least two unused steps beside it; about "
            "zero only rows that are 0 in all channels count, ten times as many as chance makes"
        ),
    ),
    "fill_value": (
        "the end of a range that knocks reach; two levels in turn",
        (
            "one exact value, three times at least, alone far from all others. Knocks that always end at the same"
            " value look alike, and are no readings either"
        ),
    ),
    "held_samples": (
        "a frozen stretch; coarse steps; motion, which changes how often neighbors are equal",
        (
            "frozen stretches are left out before; repeats by the step have no clock, those of a slower sensor come at "
            "a steady rate"
        ),
    ),
    "interleaved": (
        "one spike or a wild first row; a step, a ramp; a line near half the rate",
        (
            "nine quarters in ten of all pieces of the record must show the same order of levels, each about the "
            "moving mean and with its extremes cut: a spike is in one piece, a line turns over. A line locked to "
            "a whole fraction of the rate looks alike"
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
        "a step back, or stamps that are equal, is no jitter",
    ),
    "duplicate_stamps": (
        "coarse stamps",
        "the stamps around are finer than the interval",
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
        "five standard errors beyond it, or half an interval by medians of many stamps",
    ),
    "decimated": (
        "a clock that is off",
        "the ratio is a whole number within 1 %",
    ),
    "coarse_stamps": (
        "duplicate stamps",
        "the steps of the stamps are wider than the sample interval",
    ),
    "no_time_stamps": (
        "stamps set aside by `--rate`",
        "the message names where the rate came from",
    ),
    "ragged_rows": (
        "a cut last line",
        "that one is counted apart",
    ),
    "cells_missing": (
        "a word for overload",
        "overload words are counted apart",
    ),
    "unterminated_last_line": (
        "a short last row",
        "the line has no end",
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
        "it was asked for",
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
        "the settings of the meter say it",
    ),
    "scale_uncertain": (
        "none",
        "it was stated",
    ),
    "spikes": (
        "noise with heavy tails; a knock that rings; a step of the level",
        "few, in short bursts, with a quiet record beside them; a step stays where it went",
    ),
    "heavy_tails": (
        "spikes; a disturbance",
        "too many for isolated impulses, and evenly over the record",
    ),
    "contaminated": (
        "spikes; noise that changes; coarse steps; Student or Laplace noise",
        (
            "a mixture of two spreads must be likelier than each of these laws, the wide samples must not cluster, and "
            "they must come evenly over the record"
        ),
    ),
    "disturbance": (
        "drift and flicker; spikes; a change of the noise",
        (
            "differences of block means do not see drift; spikes are taken out before; a window must exceed four times "
            "the quiet power. Noise up to five times louder for a time, by the same factor at every lag, is "
            "`noise_changes`"
        ),
    ),
    "not_at_rest": (
        "a disturbance",
        "over 17 times the deviation of the quiet parts at some lag",
    ),
    "motion": (
        "drift of an accelerometer's bias",
        "2 deg are 34 mg: no bias drifts so far",
    ),
    "amplitude_drop": (
        "a frozen or held stretch",
        "those are left out before; the power is below half, not 0",
    ),
    "noise_changes": (
        "a disturbance; chance",
        (
            "parts of the record against chi-square, one record in 10 000 by chance; no window stands out beyond the "
            "noise from sample to sample around it"
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
        "where the unit turned, its usual second counts; one that moves all along is left alone; mix-ups are named",
    ),
    "unit_trap": (
        "a vibrating gyro",
        "the quiet windows decide, and a ratio of 57.3 is named",
    ),
    "bias_removed": (
        "a good gyro at right angles to the Earth's axis; a simulated record",
        "two axes of a triad, by chance in one record of 100",
    ),
    "floor_taken_off": (
        "none",
        "it was asked for",
    ),
    "floor_dominates": (
        "a sensor quieter than its instrument",
        "none: that is what it says",
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
        "a bad fit",
        "the curve is fitted well, the spectrum is another",
    ),
    "short_lags_left_out": (
        "quantisation",
        "no sum of noise terms has that slope",
    ),
    "model_discrepancy": (
        "too small intervals",
        "the curve against its own covariance",
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
        "it was asked for",
    ),
    "temperature_not_resolved": (
        "a drift of the sensor",
        "temperature that only rises cannot be told from time",
    ),
    "hysteresis": (
        "a lag of the sensor behind its temperature",
        "the branches differ at one temperature beyond a lag",
    ),
    "warm_up": (
        "a random walk; a ramp",
        "the exponential against noise of the fitted kind",
    ),
    "turns_by_size": (
        "knocks of one size",
        "angles near half a turn, accelerometers that change sign with them, or the list of turns",
    ),
    "turns_by_rhythm": (
        "knocks in time",
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
        "a long dwell that was planned",
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
        "no angle is left after it",
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
        "the nearest movement of the signal",
    ),
    "checksum_failed": (
        "sentences of another form",
        "only lines that state a checksum are held to it",
    ),
    "labeled_lines": (
        "messages of the logger between its samples",
        "only lines with two or more of the log's labels are held to its form",
    ),
    "cell_suffix": (
        "words; a second delimiter",
        "most cells of the column begin with a number",
    ),
    "raw_counts": (
        "readings that were rounded to whole numbers",
        "a step of 1 without a unit, in the range of a 16-bit word; gravity tells the range of an accelerometer",
    ),
}
