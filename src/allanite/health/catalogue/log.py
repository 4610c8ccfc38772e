# SPDX-License-Identifier: BSD-3-Clause
"""Faults of the log: time, text."""

from __future__ import annotations

from allanite.health.catalogue.entry import Entry

__all__ = ["LOG"]

_TIME, _TEXT = ("Time", "Text")

LOG: dict[str, Entry] = {
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
}
