# SPDX-License-Identifier: BSD-3-Clause
"""Every finding by its code: how grave it can be, what it means, what accepting it risks, what is done.

`docs/reference/findings.md` is this table in print (`findings_page`); a test keeps the two equal.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["CATALOGUE", "Entry", "findings_page"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One kind of finding.

    Attributes
    ----------
    group : str
        Heading in the printed table.
    severity : str
        The severities it can have, mildest first.
    means : str
        What the recording shows.
    risk : str
        What accepting it would risk.
    done : str
        What allanite does about it.
    advice : str
        What the user may do.
    excludes : bool
        True when the samples in question are left out of the analysis.
    """

    group: str
    severity: str
    means: str
    risk: str
    done: str
    advice: str
    excludes: bool = False


_MISSING, _RANGE, _STEPS, _REPEATS, _REST, _MEANING, _TIME, _TEXT, _SPECTRUM, _TURNS = (
    "Missing samples",
    "Range",
    "Resolution",
    "Repeated samples",
    "Rest",
    "Meaning",
    "Time",
    "Text",
    "Spectrum",
    "Turns",
)

#: Code -> what it means. The order is the order of the printed table.
CATALOGUE: dict[str, Entry] = {
    "no_samples": Entry(
        group=_MISSING,
        severity="fatal",
        means="a channel holds no sample at all",
        risk="there is nothing to analyse; accepted, the channel is left out",
        done="refused",
        advice="choose other channels, or look for the fault in the log",
    ),
    "too_short": Entry(
        group=_MISSING,
        severity="fatal",
        means="fewer samples than a noise model needs",
        risk="intervals as wide as the estimates; no term can be told from another",
        done="refused",
        advice="record longer",
    ),
    "broken_up": Entry(
        group=_MISSING,
        severity="fatal",
        means="no stretch without a missing sample is long enough; often two sensors share the rows of one log",
        risk="almost no average fits between the gaps, so the curve rests on a few samples or is empty",
        done="refused",
        advice="if the values come every k-th row, split the log by sensor and give the true rate",
    ),
    "missing": Entry(
        group=_MISSING,
        severity="info, warning",
        means="samples are missing (NaN, empty cells, gaps in the time stamps)",
        risk="fewer averages at lags longer than the unbroken stretches",
        done="left as gaps: nothing is filled in and no average crosses them",
        advice="none needed; for longer lags record without gaps",
    ),
    "overload": Entry(
        group=_RANGE,
        severity="warning, fatal",
        means="overload words (9.9E37, 9.91E37, 1E38, infinity): the instrument was out of range",
        risk="what the sensor did while out of range is unknown, and it comes back slowly; the rest may be biased",
        done="left out; fatal above 0.1 % of the samples",
        advice="choose a wider range or find what drove the sensor out of it",
        excludes=True,
    ),
    "saturated": Entry(
        group=_RANGE,
        severity="warning, fatal",
        means="the extreme code of an integer word (32767, -32768, 65535, ...) stands far from the rest or repeats",
        risk="a code that means 'out of range' is taken for a value: one is enough to raise the whole curve",
        done="left out; fatal above 0.1 % of the samples",
        advice="choose a wider range",
        excludes=True,
    ),
    "clipping": Entry(
        group=_RANGE,
        severity="warning, fatal",
        means="more samples stand at the outermost value than the values next to it allow: the range ends there",
        risk="N comes out too small, by 28 % if clipped at one standard deviation",
        done="kept as they are; fatal where the range ends within about 3 standard deviations",
        advice="choose a wider range and record again",
    ),
    "implausible_exponents": Entry(
        group=_RANGE,
        severity="fatal",
        means="the values spread over tens of powers of ten, as no sensor's do: wrong byte order or wrong type",
        risk="the numbers are not the sensor's",
        done="refused",
        advice="read the file again with the other byte order or another number type",
    ),
    "no_noise_resolved": Entry(
        group=_STEPS,
        severity="fatal",
        means="all samples are equal: the noise is below the resolution, or the channel is dead",
        risk="a deviation of exactly 0, which is not the sensor's",
        done="refused",
        advice="raise the gain or the number of digits; check the wiring",
    ),
    "quantisation_limited": Entry(
        group=_STEPS,
        severity="fatal",
        means="the noise from sample to sample is less than half a step of the values",
        risk="N is the converter's: 0 or several times too large, by where the level lies between the steps",
        done="refused",
        advice="raise the gain or log more digits; averages long enough to cross many steps are less affected",
    ),
    "quantisation": Entry(
        group=_STEPS,
        severity="warning",
        means="the step of the values is more than half the noise from sample to sample",
        risk="the step's own noise is part of N",
        done="kept; the share is stated. It is white and belongs to N, not to Q",
        advice="log more digits or raise the gain",
    ),
    "quantisation_not_white": Entry(
        group=_STEPS,
        severity="warning",
        means="an angle moves on by too regular a part of its step: the rounding errors follow a pattern",
        risk="Q is off by a factor of 0.3 to 1.6, and lines appear in the spectrum",
        done="kept",
        advice="do not read Q as step/sqrt(12); record finer angles",
    ),
    "resolution_step": Entry(
        group=_STEPS,
        severity="info",
        means="the values are multiples of a step, which is stated with its ratio to the noise",
        risk="",
        done="kept; harmless",
        advice="none needed",
    ),
    "float_step": Entry(
        group=_STEPS,
        severity="warning",
        means="the level is so large that neighbouring floating-point numbers lie more than a tenth of the noise apart",
        risk="the rounding adds to N; at twice the noise it replaces it",
        done="kept; the share is stated",
        advice="subtract the level before storing, or store float64",
    ),
    "stuck": Entry(
        group=_REPEATS,
        severity="warning, fatal",
        means="one value repeats longer than chance allows (once in 10 000 records): a frozen reading",
        risk="steps at both ends raise the curve, and the flat part lowers it",
        done="left out; fatal when that is more than half of the samples",
        advice="find why the reading froze",
        excludes=True,
    ),
    "zero_filled": Entry(
        group=_REPEATS,
        severity="warning, fatal",
        means="exact zeros far from the level: lost samples written as 0, a first sample or a tail of zeros",
        risk="1000 zeros at a level of 20 sigma raise the curve five times",
        done="left out; fatal when that is more than half of the samples",
        advice="write lost samples as empty cells",
        excludes=True,
    ),
    "held_samples": Entry(
        group=_REPEATS,
        severity="warning",
        means="samples repeat the one before: the sensor delivers fewer values than the log has rows",
        risk="the shortest lags come out too small; white noise bends there",
        done="kept; the true rate is suggested",
        advice="keep one row of each repeated value and give the true rate",
    ),
    "interleaved": Entry(
        group=_REPEATS,
        severity="warning, fatal",
        means="rows k, 2k, ... differ from the rows between them in level or in noise: two sensors in one column",
        risk="the difference between the sensors is taken for noise at the shortest lags",
        done="kept; fatal where the levels differ by more than 3 sigma",
        advice="split the log by sensor",
    ),
    "half_before_gap": Entry(
        group=_REPEATS,
        severity="warning",
        means="just before a gap the level or the noise is half of what it is elsewhere: a block cut short",
        risk="a step at each gap raises the curve",
        done="left out",
        advice="drop the last block before each gap when logging",
        excludes=True,
    ),
    "duplicate_channels": Entry(
        group=_REPEATS,
        severity="warning",
        means="two channels hold the same samples, or one is a fixed multiple of the other",
        risk="one of them is not what its name says, and their agreement proves nothing",
        done="kept",
        advice="look up which column belongs to which axis",
    ),
    "spikes": Entry(
        group=_REST,
        severity="info, warning",
        means="samples far from those around, alone or in short bursts, beyond what noise does once in 1000 records",
        risk="each adds its square to the white noise: one of 1000 sigma in 200 000 samples raises it 2.4 times",
        done="the largest are left out, as many as keep N within 0.5 %; N with and without is stated",
        advice="find the cause: a knock, a bit error, a switching load",
        excludes=True,
    ),
    "heavy_tails": Entry(
        group=_REST,
        severity="warning",
        means="so many large steps that they are no isolated impulses: vibration, or noise that is not Gaussian",
        risk="intervals are too narrow",
        done="kept",
        advice="look at the time series",
    ),
    "disturbance": Entry(
        group=_REST,
        severity="info, warning",
        means="in some stretches the signal moves much more than in the quiet ones: vibration, a turn, a warm-up",
        risk="the curve describes the disturbance, not the sensor, at the lags stated",
        done="kept; noise, flicker and random walk alone set this off in less than 1 of 100 records",
        advice="analyse the quiet part alone: --from, --to",
    ),
    "not_at_rest": Entry(
        group=_REST,
        severity="fatal",
        means="the signal's movement is over 17 times that of its quiet parts at some lag: the sensor was moved",
        risk="every number describes the motion",
        done="refused",
        advice="analyse a quiet part alone (--from, --to), or record at rest",
    ),
    "motion": Entry(
        group=_REST,
        severity="warning",
        means="the direction of gravity in three accelerometers changes by over 2 deg: the unit was turned",
        risk="mean, drift and slow noise of all its axes hold the turn; slow turns show nowhere else",
        done="kept",
        advice="of a record that is meant to be at rest, analyse the part before the turn alone: --from, --to",
    ),
    "amplitude_drop": Entry(
        group=_REST,
        severity="info",
        means="in some stretches the noise has less than half its usual power",
        risk="",
        done="kept",
        advice="check for a change of range, filter or power mode",
    ),
    "unit_missing": Entry(
        group=_MEANING,
        severity="warning",
        means="nobody knows the unit of the channel",
        risk="results stay in the channel's own unit and cannot be exported",
        done="kept in its own unit; never guessed",
        advice="state it: --unit NAME=UNIT",
    ),
    "counts": Entry(
        group=_MEANING,
        severity="info",
        means="the channel is in counts",
        risk="",
        done="results stay in LSB",
        advice="give the scale factor for physical units",
    ),
    "gravity": Entry(
        group=_MEANING,
        severity="warning",
        means="the mean vector of an accelerometer triad is not 1 g long (by over 1 %)",
        risk="a wrong unit or scale changes every number by the same factor",
        done="kept; a ratio near 9.8 is named as a unit mix-up",
        advice="check unit and scale factor",
    ),
    "unit_trap": Entry(
        group=_MEANING,
        severity="warning",
        means="a gyro noisier than any: degrees labelled as radians (57.3) would explain it",
        risk="every number is 57.3 times too large",
        done="kept",
        advice="check the unit: --unit NAME=deg/s",
    ),
    "bias_removed": Entry(
        group=_MEANING,
        severity="warning",
        means="the gyro's mean is zero within its own noise: the bias was subtracted before logging",
        risk="the Earth's rotation went with the bias and cannot be measured; the slowest noise is altered too",
        done="kept; N is not affected",
        advice="log the uncalibrated gyro if the Earth's rotation or the bias matter; ignore it for simulated data",
    ),
    "aliasing": Entry(
        group=_MEANING,
        severity="info, warning",
        means="each sample averages over less than its interval",
        risk="wide-band noise folds down: N reads too large by up to the factor stated",
        done="kept; the factor sqrt(interval/aperture) is stated",
        advice="average over the whole interval, or divide N by the factor if the sensor's band is wide",
    ),
    "time_stamps": Entry(
        group=_TIME,
        severity="fatal",
        means="time stamps contradict each other: steps back, or over 0.1 % duplicates",
        risk="rows may be in the wrong order or twice, and the rate may be wrong",
        done="refused; the first five rows are listed",
        advice="sort or repair the rows, or give --rate, which sets the stamps aside",
    ),
    "duplicate_stamps": Entry(
        group=_TIME,
        severity="warning",
        means="a few rows carry the stamp of the row before",
        risk="rows that stand twice in the log",
        done="kept",
        advice="look at the rows listed",
    ),
    "rate_jitter": Entry(
        group=_TIME,
        severity="info, warning",
        means="time stamps scatter about the even grid",
        risk="if the samples themselves came at uneven times, a moving angle shows it as noise",
        done="samples are taken as even in time; the effect is estimated and stated",
        advice="use the sensor's own sample counter or clock",
    ),
    "rate_not_median": Entry(
        group=_TIME,
        severity="info",
        means="the median interval tells another rate than the count of samples over the span",
        risk="",
        done="the rate is that of the stamps as a whole",
        advice="none needed; tools that use the median get the time axis wrong",
    ),
    "clock_rate": Entry(
        group=_TIME,
        severity="warning",
        means="the stamps, or the rate given, differ from the header's rate by more than 100 ppm",
        risk="lags and coefficients shift by that much if the header is right",
        done="the rate given, else that of the stamps, is used",
        advice="check which clock is right",
    ),
    "decimated": Entry(
        group=_TIME,
        severity="warning",
        means="the rate is a whole fraction of the nominal one: every k-th sample was logged",
        risk="without averaging, N reads up to sqrt(k) too large (aliasing)",
        done="kept",
        advice="log at the full rate, or average k samples",
    ),
    "coarse_stamps": Entry(
        group=_TIME,
        severity="info",
        means="the stamps are coarser than the sample interval",
        risk="",
        done="the rate is that of the stamps as a whole",
        advice="log finer stamps",
    ),
    "no_time_stamps": Entry(
        group=_TIME,
        severity="info",
        means="there are no time stamps, or --rate sets them aside: lost samples cannot be seen",
        risk="a wrong rate changes every lag and coefficient",
        done="the rate that was given is used",
        advice="check the rate; log time stamps",
    ),
    "ragged_rows": Entry(
        group=_TEXT,
        severity="warning",
        means="rows with too few or too many cells",
        risk="samples are missing there, or stand in the wrong column",
        done="read as missing",
        advice="look at the rows listed",
    ),
    "cells_missing": Entry(
        group=_TEXT,
        severity="info",
        means="cells that are empty or hold words such as NaN or undefined",
        risk="",
        done="read as missing",
        advice="none needed",
    ),
    "unterminated_last_line": Entry(
        group=_TEXT,
        severity="warning",
        means="the last line has no end: its last number may be cut",
        risk="",
        done="the line is dropped",
        advice="none needed; the logger was interrupted",
    ),
    "nul_bytes": Entry(
        group=_TEXT,
        severity="warning",
        means="NUL bytes in the text: a block of the disk was never written",
        risk="rows are lost there without a trace, if there are no time stamps",
        done="skipped and counted",
        advice="look for lost rows",
    ),
    "dialect_guessed": Entry(
        group=_TEXT,
        severity="info",
        means="decisions about delimiter, decimal sign, columns, units or topic that the file does not settle",
        risk="a wrong decision gives wrong numbers everywhere",
        done="stated",
        advice="check them; --delimiter, --decimal, --unit, --channels and --topic decide",
    ),
    "spectral_line": Entry(
        group=_SPECTRUM,
        severity="warning",
        means="a line in the spectrum: mains, a motor, a dither",
        risk="it bends the curve and imitates quantisation or flicker",
        done="lags that it bends are kept out of the fit",
        advice="find the source",
    ),
    "short_lags_left_out": Entry(
        group=_SPECTRUM,
        severity="warning",
        means="the shortest lags follow no sum of noise terms: a filter, vibration, repeated samples",
        risk="what happens at those lags is not in the model",
        done="the fit begins at a longer lag",
        advice="look at the spectrum; record the sensor unfiltered",
    ),
    "model_discrepancy": Entry(
        group=_SPECTRUM,
        severity="warning",
        means="no sum of noise terms explains the curve within its own uncertainty",
        risk="the coefficients describe the curve only to the stated share",
        done="every lag gets that share as a model error, and the intervals hold it",
        advice="look for disturbance, temperature or vibration in the record",
    ),
    "not_fitted": Entry(
        group=_SPECTRUM,
        severity="warning",
        means="too few lags are free of lines, filter and gaps for a noise model",
        risk="none: nothing is claimed",
        done="the curve is shown, no model is fitted",
        advice="record longer, or remove what bends the curve",
    ),
    "band_limited": Entry(
        group=_SPECTRUM,
        severity="info, warning",
        means="the spectrum falls towards half the sample rate: the sensor's low-pass filter",
        risk="the shortest lags lie below the white noise",
        done="those lags are kept out of the fit",
        advice="none needed",
    ),
    "turns_by_size": Entry(
        group=_TURNS,
        severity="info, warning",
        means="surges of equal size that are not half turns by their angle: another unit, an axis that hardly sees it",
        risk="surges of equal size that are no turns would alternate the direction wrongly",
        done="they count as half turns",
        advice="check unit, scale factor and axis, or list the turns",
    ),
    "turns_by_rhythm": Entry(
        group=_TURNS,
        severity="warning",
        means="surges without an angle, as long as turns, at even intervals",
        risk="a knock in time with the turns would alternate the direction wrongly",
        done="they count as half turns",
        advice="list the turns",
    ),
    "turn_unlike": Entry(
        group=_TURNS,
        severity="warning",
        means="a turn that is not half a turn",
        risk="the axis stands off north and south: the rate reads too small",
        done="after a quarter turn the direction counts as unknown",
        advice="turn again, or list the turns",
    ),
    "turns_clipped": Entry(
        group=_TURNS,
        severity="info",
        means="turns beyond the range of the converter",
        risk="",
        done="their angle is a lower bound",
        advice="none needed",
    ),
    "turn_missed": Entry(
        group=_TURNS,
        severity="info",
        means="a dwell much longer than the others",
        risk="",
        done="the direction is counted by the turns that were made",
        advice="none needed",
    ),
    "turn_doubled": Entry(
        group=_TURNS,
        severity="warning",
        means="a dwell much shorter than the others: turned twice, or one of the turns is none",
        risk="a knock taken for a turn reverses all that follows",
        done="every turn that was seen counts",
        advice="compare with the notes taken",
    ),
    "turn_hidden": Entry(
        group=_TURNS,
        severity="warning",
        means="a turn that no signal shows, told by the others",
        risk="one turn too many reverses all that follows",
        done="it counts",
        advice="compare with the notes taken",
    ),
    "direction_unknown": Entry(
        group=_TURNS,
        severity="info, warning",
        means="a stretch without readings that may hide a turn",
        risk="taken for another direction, it would count against the rate",
        done="what follows is left out of the rate until its direction is known",
        advice="list the turns",
    ),
    "gap_without_turn": Entry(
        group=_TURNS,
        severity="info",
        means="a stretch without readings that hides no turn, by what surrounds it",
        risk="",
        done="the direction is kept",
        advice="none needed",
    ),
    "dwell_disturbed": Entry(
        group=_TURNS,
        severity="info",
        means="a knock or another disturbance that is no turn",
        risk="",
        done="it is cut out of the dwell",
        advice="none needed",
    ),
    "dwell_stuck": Entry(
        group=_TURNS,
        severity="warning",
        means="one repeated value for a while",
        risk="readings before and after may be wrong as well",
        done="it is left out of the dwell",
        advice="find why the reading froze",
    ),
    "turn_not_listed": Entry(
        group=_TURNS,
        severity="warning",
        means="a turn in the signal that the list of turns does not hold",
        risk="the direction after it is wrong if the list is",
        done="it is cut out, without a change of direction",
        advice="compare list and signal",
    ),
    "turn_not_seen": Entry(
        group=_TURNS,
        severity="warning",
        means="a listed turn that is not in the signal",
        risk="the direction after it is wrong if the list is",
        done="it counts",
        advice="compare list and signal",
    ),
}


_HEADINGS = ("code", "severity", "what it means", "what accepting it risks", "what is done", "what to do")


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def findings_page() -> str:
    """The catalogue as the reference page ``docs/reference/findings.md``."""
    lines = [
        "# Findings",
        "",
        "What `allanite info` and `allanite characterize` may find wrong with a recording, and what its turns may show",
        "(last table). Nothing is repaired:",
        "samples are kept, or left out and named. A *fatal* finding refuses the analysis; `--accept CODE` goes on",
        "in spite of it, and the result says so. A *warning* says that a number suffers. An *info* is worth",
        "knowing. Samples that are left out keep their place in time: they become gaps.",
        "",
        "False alarms: on simulated white noise, flicker and random walk, fewer than 1 record in 100 has any",
        "finding but `resolution_step` and those that come from the file.",
    ]
    group = ""
    for code, entry in CATALOGUE.items():
        if entry.group != group:
            group = entry.group
            lines += ["", f"## {group}", "", _row(_HEADINGS), _row(("---",) * len(_HEADINGS))]
        risk = entry.risk or "nothing"
        lines.append(_row((f"`{code}`", entry.severity, entry.means, risk, entry.done, entry.advice)))
    return "\n".join(lines) + "\n"
