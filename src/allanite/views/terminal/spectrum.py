# SPDX-License-Identifier: BSD-3-Clause
"""Spectra as text: densities, lines, and whether the model agrees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.noise.spectrum import Spectrum
from allanite.views.terminal.console import console
from allanite.views.terminal.parts import say_end, say_facts, say_rows
from allanite.views.wording import density_lines, line_lines, spectral_agreement, spectrum_facts

__all__ = ["show_spectrum"]

Json = Mapping[str, Any]


def show_spectrum(document: Json, files: Sequence[object] = ()) -> None:
    """Densities, lines and facts of each channel of a document of spectra."""
    out = console()
    for channel in document["channels"]:
        out.print(channel["name"], style="bold")
        level = f"{100 * channel['spectrum']['confidence']:g} % interval"
        model = channel.get("expected") is not None
        rows = density_lines(channel)
        heads = ("Frequency", f"Root density, {level}", "model")
        say_rows(out, heads if model else heads[:2], rows if model else [row[:2] for row in rows])
        say_rows(
            out,
            ("Line", "Amplitude", "Chance", "Through the record"),
            line_lines(
                channel["kind"], channel.get("unit") or "", Spectrum.from_json(channel["spectrum"]).lines
            ),
        )
        if agreement := spectral_agreement(channel):
            out.print(agreement, soft_wrap=True)
            out.print()
        say_facts(out, *spectrum_facts(channel))
    say_end(out, document, files)
