# SPDX-License-Identifier: BSD-3-Clause
"""What the report of spectra says, from their plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.noise.spectrum import Spectrum
from allanite.views.blocks import (
    Banner,
    Page,
    PageBlock,
    References,
    Subheading,
    Text,
    drawn,
    equation,
    findings,
    pairs,
    table,
)
from allanite.views.report.measurement import measurement_page
from allanite.views.wording import (
    density_lines,
    duration,
    line_lines,
    model_words,
    spectral_agreement,
    spectrum_facts,
)

__all__ = ["LINE_HEADS", "page"]

Json = Mapping[str, Any]

LINE_HEADS = ("Line", "Amplitude", "Chance", "Through the record")
WELCH = (
    "P. D. Welch, “The use of fast Fourier transform for the estimation of power spectra”, IEEE Trans. Audio "
    "Electroacoust. 15 (1967) 70."
)
HARRIS = (
    "F. J. Harris, “On the use of windows for harmonic analysis with the discrete Fourier transform”, Proc. IEEE 66 "
    "(1978) 51."
)
SYKULSKI = "A. Sykulski et al., “The debiased Whittle likelihood”, Biometrika 106 (2019) 251."


def page(document: Json) -> Page:
    """The page of the spectra of a log."""
    recording = document["recording"]
    return measurement_page(
        document,
        title=document["provenance"].get("source") or "Spectra",
        kicker="Power spectral density",
        facts=[
            ("Channels", ", ".join(c["name"] for c in document["channels"])),
            ("Length", duration(recording["duration"])),
            ("Rate", f"{recording['rate']:.7g} Hz"),
        ],
        parts={
            "spectra": _spectra,
            "lines": _lines,
            "densities": _densities,
            "findings": findings,
            "method": _method,
        },
    )


def _spectra(document: Json) -> list[PageBlock]:
    blocks: list[PageBlock] = []
    for i, channel in enumerate(document["channels"]):
        model = "; dashed, the model as these segments would show it" if channel.get("expected") else ""
        caption = f"{channel['name']}: root of the two-sided density with its interval{model}."
        agreement = spectral_agreement(channel)
        if agreement:
            good = "do not" not in agreement
            blocks.append(Banner("good" if good else "warning", channel["name"], agreement))
        blocks += drawn(f"spectrum-{i}", document, caption, caption, channel=channel["name"])
    return blocks


def _lines(document: Json) -> list[PageBlock]:
    return [
        block
        for channel in document["channels"]
        for block in table(
            LINE_HEADS,
            line_lines(
                channel["kind"], channel.get("unit") or "", Spectrum.from_json(channel["spectrum"]).lines
            ),
            caption=f"{channel['name']}: lines with 95 % intervals. Chance: that noise alone shows such a peak.",
        )
    ]


def _densities(document: Json) -> list[PageBlock]:
    blocks: list[PageBlock] = []
    for channel in document["channels"]:
        level = f"{100 * channel['spectrum']['confidence']:g} % interval"
        rows = density_lines(channel)
        model = channel.get("expected") is not None
        heads = ("Frequency", f"Root density, {level}", "Model")
        blocks.append(Subheading(channel["name"]))
        blocks += table(heads if model else heads[:2], rows if model else [row[:2] for row in rows])
        facts = [(name.capitalize(), words) for name, words in spectrum_facts(channel)]
        if channel.get("model"):
            facts.append(("Model", model_words(channel["model"])))
        blocks.append(pairs(facts))
    return blocks


def _method(_: Json) -> list[PageBlock]:
    return [
        Text("Each point is the mean of periodograms of overlapping, windowed segments:"),
        *equation("periodogram"),
        Text(
            "Its interval is chi-square, with the degrees of freedom that window and overlap leave. A model is drawn "
            "as these segments would show it: its density folded by sampling, averaged over the window. Isolated "
            "missing samples are bridged by their expected value, and the density of its errors is added: the "
            "chi-square law is that of the rest, and the interval holds the error of what was added. Segments that "
            "hold longer gaps are left out. A line is steady when its amplitude and phase, part by part of the "
            "record, scatter no more than the noise around it explains; then it is a sinusoid, and can be taken out."
        ),
        References([WELCH, HARRIS, SYKULSKI]),
    ]
