# SPDX-License-Identifier: BSD-3-Clause
"""What a variation says: its verdict, its changes, and how constant every lag is."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number, probability
from allanite.stability.variation import Change, ChannelVariation, LagTest, Variation
from allanite.stability.variation.remarks import remarks
from allanite.stability.variation.words import part_name, visible_steps
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Page, PageBlock, References, Text, drawn, equation, pairs, table
from allanite.views.result_page import advice, findings_of, result_page, verdict_banner
from allanite.views.wording.rates import model_words

__all__ = ["rows", "view"]

#: Lags of a channel that a table lists.
_MOST = 8
_ANDREWS = (
    "D. W. K. Andrews, “Tests for parameter instability and structural change with unknown change point”, "
    "Econometrica 61 (1993) 821."
)
_REFERENCES = (
    "L. Galleani, P. Tavella, “The dynamic Allan variance”, IEEE Trans. UFFC 56 (2009) 450.",
    "E. Wilson, M. Hilferty, “The distribution of chi-square”, PNAS 17 (1931) 684.",
    _ANDREWS,
    "B. E. Hansen, “Sample splitting and threshold estimation”, Econometrica 68 (2000) 575.",
)
_METHOD = (
    "Windows share no term, and at long averaging times they are joined until four lags fit into each; "
    "lags with fewer than four windows carry no information about change. The scatter of windows and the "
    "correlation of neighbors and lags come from the exact covariance under the noise model of the whole "
    "record; the level of every lag is free, so the model need not fit. Cube roots of variances are "
    "nearly normal. There are two tests, each at half the stated false-alarm rate: the chi-square of all "
    "windows, and the largest score of a step at any time, or a drift, of any term, with its distribution "
    "simulated for this record. The interval of the time of a step contains the times that the likelihood "
    "does not reject."
)


def view(document: ResultDocument[Variation]) -> Page:
    """The page of a variation."""
    result = document.result
    return result_page(
        document,
        title=result.source or "Deviation over time",
        kicker="Does the noise change during the record?",
        facts=[
            ("Channels", ", ".join(c.name for c in result.channels)),
            ("Length", duration(result.duration)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", [*_pictures(result)]),
            "lags": ("Constancy of every lag", [*_lags(result)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method()),
        },
    )


def _verdict(result: Variation) -> Iterator[PageBlock]:
    names = [c.name for c in result.channels]
    yield verdict_banner(result.verdict, result.reason, names)
    yield from table(
        ("Channel", "What", "When", "After over before", "Chance"),
        [_change_row(channel, change) for channel in result.channels for change in channel.changes],
        caption=f"Changes with their {100 * result.confidence:g} % intervals.",
    )
    yield from advice(
        [f"{c.name}: {r}" for c in result.channels for r in remarks(c, result.false_alarm)], names
    )
    tests = (f"{c.name}: χ² {c.chi2:.0f} ({c.dof:.0f} expected), {probability(c.p)}" for c in result.channels)
    steps = (f"{c.name}: {s}" for c in result.channels if (s := visible_steps(c.visible)))
    yield pairs(
        [
            ("Channels", ", ".join(names)),
            ("All windows together", "; ".join(tests)),
            ("Detectable steps", "; ".join(steps)),
            ("False alarms", f"{100 * result.false_alarm:g} % of channels whose noise is constant"),
            ("Length", duration(result.duration)),
        ]
    )


def _change_row(channel: ChannelVariation, change: Change) -> tuple[str, ...]:
    return (
        channel.name,
        part_name(change.symbol),
        "from the first to the last sample" if change.time is None else str(change.time),
        str(change.ratio) if change.ratio.resolved else "not resolved",
        probability(change.p),
    )


def _pictures(result: Variation) -> Iterator[PageBlock]:
    for i, channel in enumerate(result.channels):
        caption = (
            f"{channel.name}: Allan deviation over time and averaging time, relative to the whole record. "
            "Red: larger, blue: smaller. Framed windows deviate significantly (family-wise); pale ones do not."
        )
        yield from drawn(f"map-{i}", result, caption, caption, view="map", channels=[channel.name])
        caption = f"{channel.name}: some averaging times, every window with its interval."
        yield from drawn(f"lines-{i}", result, caption, caption, view="lines", channels=[channel.name])


def _lags(result: Variation) -> Iterator[PageBlock]:
    yield from table(
        ("Channel", "Averaging", "Windows", "Least to largest", "Whole record", "Differ", "Constant"),
        [_lag_row(channel, lag) for channel in result.channels for lag in _told(channel.lags)],
        caption="Each averaging time separately: chi-square of its windows with their exact covariance.",
    )
    yield pairs([(f"Noise of {c.name}", model_words(c.model)) for c in result.channels], brief=False)


def _told(lags: tuple[LagTest, ...]) -> list[LagTest]:
    """Some of them, and those in which a window stands out."""
    step = max(1, -(-len(lags) // _MOST))
    chosen = [lag for i, lag in enumerate(lags) if i % step == 0 or lag.significant.any()]
    return chosen[: 2 * _MOST]


def _lag_row(channel: ChannelVariation, lag: LagTest) -> tuple[str, ...]:
    unit, factor = display_unit(channel.kind, "adev", channel.unit)
    least, largest = (number(v / factor) for v in (lag.deviation.min(), lag.deviation.max()))
    return (
        channel.name,
        duration(lag.tau),
        f"{lag.start.size} of {duration(lag.window)}",
        f"{least} to {largest} {unit}",
        f"{number(lag.whole / factor)} {unit}",
        str(lag.significant.sum() or "none"),
        probability(lag.p),
    )


def _method() -> list[PageBlock]:
    return [
        Text("The overlapping Allan variance of every window of time, at every averaging time:"),
        *equation("variation"),
        Text(_METHOD),
        References(_REFERENCES),
    ]


def rows(result: Variation) -> Iterator[dict[str, object]]:
    """One row of a table for each window and lag, in SI."""
    names = ("start", "stop", "deviation", "lower", "upper", "edf", "ratio", "significant")
    for channel in result.channels:
        for lag in channel.lags:
            columns = (getattr(lag, name).tolist() for name in names)
            for values in zip(*columns, strict=True):
                yield {"channel": channel.name, "tau": lag.tau, **dict(zip(names, values, strict=True))}
