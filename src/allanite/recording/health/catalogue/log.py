# SPDX-License-Identifier: BSD-3-Clause
"""Faults of the log: time, text, and what a recorder noted."""

from __future__ import annotations

from allanite.recording.health.catalogue.entry import FindingKind

__all__ = ["LOG"]

_TIME, _TEXT, _RUN = ("Time", "Text", "What was noted")

LOG: dict[str, FindingKind] = {
    "time_stamps": FindingKind(
        group=_TIME,
        severity="fatal",
        means="inconsistent time stamps: backward steps, or over 0.1 % duplicates",
        risk="rows may be in the wrong order or twice, and the rate may be wrong",
        done="refused; the first five rows are listed",
        advice="sort or repair the rows, or pass --rate, which overrides the stamps",
        repair="drop_duplicate_rows",
    ),
    "duplicate_stamps": FindingKind(
        group=_TIME,
        severity="warning",
        means="a few rows have the same stamp as the previous row",
        risk="rows may be in the log twice",
        done="kept",
        advice="look at the rows listed",
        repair="drop_duplicate_rows",
    ),
    "rate_jitter": FindingKind(
        group=_TIME,
        severity="info, warning",
        means="time stamps scatter about the even grid",
        risk="if the samples were taken at uneven times, a changing angle, velocity or phase shows this as noise",
        done="samples are treated as evenly spaced; the effect is estimated and stated",
        advice="use the sample counter or the clock of the sensor; for a clock under test, that of the "
        "frequency counter",
    ),
    "rate_not_median": FindingKind(
        group=_TIME,
        severity="info",
        means="the median interval implies a different rate than the number of samples over the span",
        risk="",
        done="the rate comes from all stamps",
        advice="none needed; tools that use the median get the time axis wrong",
    ),
    "clock_rate": FindingKind(
        group=_TIME,
        severity="warning",
        means="the rate of the stamps, or the stated rate, differs from that of the header by more than 100 ppm",
        risk="lags and coefficients shift by that much if the header is right",
        done="the stated rate is used, otherwise that of the stamps",
        advice="check which clock is right",
    ),
    "off_grid": FindingKind(
        group=_TIME,
        severity="fatal",
        means="over 5 % of the samples are more than half an interval from any even grid, and no slow "
        "clock drift explains it",
        risk="unevenly spaced samples are analyzed as even: lags and coefficients are those of a mean rate",
        done="refused",
        advice="log the clock of the sensor; `--rate` treats the samples as even and ignores the stamps",
    ),
    "clock_drift": FindingKind(
        group=_TIME,
        severity="warning",
        means="the rate of the stamps changes by more than 100 ppm along the record, steadily or back and forth",
        risk="lags and coefficients are those of the mean rate; a slow ramp of the clock is treated as even sampling",
        done="kept; the mean rate of the stamps is used",
        advice="use stamps from the sensor's clock, or let the clock of the logger warm up",
    ),
    "decimated": FindingKind(
        group=_TIME,
        severity="warning",
        means="the log is slower than the sensor, by its header or by the autopilot: every k-th sample was logged",
        risk="without averaging, N is up to sqrt(k) too large (aliasing)",
        done="kept",
        advice="log at the full rate, or average k samples",
    ),
    "coarse_stamps": FindingKind(
        group=_TIME,
        severity="info, warning",
        means="the stamps are coarser than the sample interval",
        risk="a pause within one step is placed at its end, and may be missed if the record has few steps",
        done="the rate is that of the stamps between pauses",
        advice="log finer stamps, or name another time column (`--time`)",
    ),
    "no_time_stamps": FindingKind(
        group=_TIME,
        severity="info, warning",
        means="there are no time stamps, or --rate overrides them: lost samples cannot be detected; a warning where "
        "the stamps that it overrides restart or jump",
        risk="a wrong rate changes every lag and coefficient",
        done="the stated rate is used",
        advice="check the rate; log time stamps",
    ),
    "ragged_rows": FindingKind(
        group=_TEXT,
        severity="warning",
        means="rows with too few or too many cells",
        risk="samples are missing there, or are in the wrong column",
        done="read as missing",
        advice="look at the rows listed",
    ),
    "checksum_failed": FindingKind(
        group=_TEXT,
        severity="warning",
        means="sentences ($NAME,...*HH) with a wrong checksum: damaged in transmission",
        risk="without time stamps, a damaged line of unknown type shifts all later samples by one interval",
        done="read as missing samples; lines of unknown type are left out and counted",
        advice="reduce the load of the serial line: fewer sentences, a higher baud rate, a shorter cable",
    ),
    "labeled_lines": FindingKind(
        group=_TEXT,
        severity="info, warning",
        means="lines of labeled values (gx=0.1 gy=0.2) with a missing label, an inconsistent format, or no label",
        risk="without time stamps, a line that is left out or split shifts all later samples by one interval",
        done="values are assigned by label; missing labels and damaged lines are missing samples; other "
        "lines are left out and counted",
        advice="log time stamps; reduce the load of the serial line",
    ),
    "cell_suffix": FindingKind(
        group=_TEXT,
        severity="info, warning",
        means="cells with text after the number: a unit, or a mark such as * or !",
        risk="a mark may flag a doubtful value",
        done="the number is read; a unit is the unit of the channel",
        advice="look up the mark in the logger's manual; --unit sets the unit",
    ),
    "sensor_left_out": FindingKind(
        group=_TEXT,
        severity="warning",
        means="a column with the name or the unit of a gyro or an accelerometer holds text",
        risk="an axis is missing from the results",
        done="left out",
        advice="write its cells as plain numbers",
    ),
    "cells_missing": FindingKind(
        group=_TEXT,
        severity="info",
        means="empty cells, or words such as NaN or undefined",
        risk="",
        done="read as missing",
        advice="none needed",
    ),
    "unterminated_last_line": FindingKind(
        group=_TEXT,
        severity="warning",
        means="the last line is incomplete: its last number may be truncated",
        risk="",
        done="the line is dropped",
        advice="none needed; the logger was interrupted",
    ),
    "nul_bytes": FindingKind(
        group=_TEXT,
        severity="warning",
        means="NUL bytes in the text: a disk block was never written",
        risk="without time stamps, rows are lost there unnoticed",
        done="skipped and counted",
        advice="look for lost rows",
    ),
    "dialect_guessed": FindingKind(
        group=_TEXT,
        severity="info",
        means="assumptions about delimiter, decimal sign, columns, units or topic that the file does not settle",
        risk="a wrong assumption makes all results wrong",
        done="stated",
        advice="check them; set --delimiter, --decimal, --unit, --channels or --topic",
    ),
    "repaired": FindingKind(
        group=_RUN,
        severity="info",
        means="the recording was repaired as requested, before the analysis",
        risk="",
        done="stated, with the removed samples and the reason; what was left out is a gap",
        advice="compare with the analysis of the unrepaired log",
    ),
    "bench_file": FindingKind(
        group=_RUN,
        severity="info",
        means="units, scale factors, names or other options of reading are those of a bench file (allanite.toml)",
        risk="a file of another bench makes all results wrong",
        done="stated, with what was taken from it",
        advice="check it; --config none reads the log without it",
    ),
    "gap_reasons": FindingKind(
        group=_RUN,
        severity="info",
        means="samples are missing, and the recorder noted the reason",
        risk="",
        done="they keep their place in time, as gaps",
        advice="none needed; `allanite info` shows the table",
    ),
    "doubtful_samples": FindingKind(
        group=_RUN,
        severity="warning",
        means="the instrument driver flagged these samples as doubtful: the counter was uncertain, or a "
        "reading may be repeated or late",
        risk="invalid values, or samples at the wrong time, enter the analysis",
        done="counted, and kept",
        advice="read the remarks in manifest.jsonl, and inspect the series there",
    ),
    "instrument_remarks": FindingKind(
        group=_RUN,
        severity="info",
        means="the driver rejected lines, skipped garbage, dropped repeated frames, or the instrument restarted",
        risk="",
        done="rejected data are not samples; missing samples are gaps",
        advice="none needed if few; otherwise check cable, grounding and baud rate: manifest.jsonl lists each",
    ),
    "autozero_off": FindingKind(
        group=_RUN,
        severity="info",
        means="the voltmeter was read without autozero",
        risk="the drift of the meter looks like slow noise of the sensor",
        done="stated",
        advice="record a shorted input for as long as the sensor: its curve is the floor of the meter",
    ),
    "scale_uncertain": FindingKind(
        group=_RUN,
        severity="info",
        means="the standard uncertainty of the scale factor was stated",
        risk="",
        done="it enters the intervals of fitted noise models and of bounds in quadrature, on a logarithmic scale (the "
        "statistical interval is kept as well), and the budgets of the Earth's rate, north and align, unless "
        "--scale-uncertainty states another",
        advice="none needed",
    ),
}
