# SPDX-License-Identifier: BSD-3-Clause
"""The comment at the head of every file: where the numbers come from and every choice that was made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite import __version__
from allanite.errors import InputError
from allanite.exporters.aliased import aliasing_comments
from allanite.exporters.bounds import bound_comments, motion_comments, refuse_terms
from allanite.exporters.imu.axes import UNITS, AxisNumbers
from allanite.exporters.imu.usage import Usage
from allanite.exporters.imu.walks import GAUSS_MARKOV, Words
from allanite.exporters.renewed import renewed_lines
from allanite.exporters.triads import plain_line
from allanite.lazy_dataclasses import dataclass

__all__ = ["Consumer", "Remark", "bound_lines", "number_format", "preamble", "rate_text", "table"]

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Remark:
    """A comment line on a coefficient, for files that hold it.

    Attributes
    ----------
    text : str
    of : str
        Its symbol.
    unless : str
        Symbol of a coefficient beside which the line does not hold.
    """

    text: str
    of: str
    unless: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Consumer:
    """What is fixed about a consumer.

    Attributes
    ----------
    name, file : str
        Of the program, and of what it reads.
    usage : Usage
        Which number goes where, and what goes wrong.
    convention : tuple of str or Remark
        Comment lines: continuous or discrete and at what rate, and where that was read.
    per_axis : bool
        The file has a number for each axis.
    simulator : bool
        It makes noise in place of looking through it: of three axes the root mean square serves it by default.
    terms : tuple of str
        Letters of the terms that the file can say: a bound above the sensor is made of these.
    holds_K : bool
        It has a slot for the random walk beside a Gauss-Markov bias.
    holds_flicker : bool
        It has one for B: a model of flicker needs no correlation time, and its T is nan without one.
    holds_walk : bool
        It knows a bias that is a walk, and needs no Gauss-Markov process that resembles one.
    """

    name: str
    file: str
    usage: Usage
    convention: tuple[str | Remark, ...]
    per_axis: bool = False
    simulator: bool = False
    terms: tuple[str, ...] = ("N", "K")
    holds_K: bool = False
    holds_flicker: bool = False
    holds_walk: bool = False


def preamble(
    document: Json,
    consumer: Consumer,
    read: Mapping[str, Sequence[AxisNumbers]],
    *,
    bias: Words,
    axes: str,
    inflate: float,
) -> list[str]:
    """Comment lines, without a comment sign.

    Parameters
    ----------
    read : mapping of str to sequence of AxisNumbers
        By sensor: lines on coefficients that are not among them are left out.
    bias : callable
        Symbols of these coefficients -> what became of the bias.
    axes : str
        The rule for three axes, in words.
    """
    provenance, recording = document.get("provenance") or {}, document["recording"]
    source = provenance.get("source") or "samples or models in memory"
    digest = f", SHA-256 {provenance['sha256']}" if provenance.get("sha256") else ""
    span = f", {recording['duration']:g} s at" if "duration" in recording else ", for"
    bound = any(model.get("overbound") for channel in document["channels"] for model in channel["models"])
    moved = any(model.get("in_motion") for channel in document["channels"] for model in channel["models"])
    inflated = (
        "INFLATED to a bound, see below"
        if bound
        else "of a sensor IN MOTION, see below"
        if moved
        else "not inflated"
    )
    if inflate != 1:
        inflated = f"INFLATED by {inflate:g}{' ON TOP of a bound' * bound} (the table below is not)"
    held = _symbols(read)
    return [
        f"IMU noise for {consumer.name}, written by allanite {__version__}",
        f"from {plain_line(source)}{digest}{span} {rate_text(recording['rate'])} Hz",
        *renewed_lines(document["channels"]),
        *_that_hold(consumer.convention, held),
        *consumer.usage.cautions,
        *bias(held),
        f"{axes}; {inflated}",
        *_that_hold(_LEGEND, held),
    ]


#: Symbol of a number with an interval, and of one that is left out.
_INTERVAL, _OUT = "[]", "out"
_LEGEND = (
    Remark("B: IEEE Std 952 coefficient (floor of the Allan deviation / 0.664)", "B"),
    Remark("[ ]: 95 % interval", _INTERVAL),
    Remark("LEFT OUT: not in the numbers of this file", _OUT),
)
#: Symbols that share a unit, in the order of `UNITS` with that of the bias between its two.
_COLUMNS = (("N",), ("B", "sigma"), ("K", "q_c", "walk"))


def _symbols(read: Mapping[str, Sequence[AxisNumbers]]) -> frozenset[str]:
    """Of everything that the table says."""
    numbers = [n for axes in read.values() for axis in axes for note in axis.notes for n in note.there]
    signs = {_INTERVAL for n in numbers if n.has_interval} | {_OUT for n in numbers if n.is_out}
    return frozenset(n.symbol for n in numbers) | signs


def _that_hold(lines: Sequence[str | Remark], held: frozenset[str]) -> list[str]:
    return [
        line if isinstance(line, str) else line.text
        for line in lines
        if isinstance(line, str) or (line.of in held and line.unless not in held)
    ]


def table(read: Mapping[str, Sequence[AxisNumbers]]) -> list[str]:
    """Comment lines on every channel, by sensor."""
    lines = []
    for sensor, axes in read.items():
        if not axes:
            missing = (
                "the log holds none in known units; its numbers are not in this file and are yours to add"
            )
            lines += ["", f"{sensor}: {missing}"]
            continue
        lines += ["", f"{sensor}, {_columns(sensor, _symbols({sensor: axes}))}:"]
        for axis in axes:
            notes = [str(note) for note in axis.notes]
            if len(notes) > 1:
                notes.append("the record cannot decide between these two; the larger numbers are used")
            lines += [f"  {plain_line(axis.name)}: {note}" for note in notes]
    return lines


def _columns(sensor: str, held: frozenset[str]) -> str:
    """The symbols of a table and their units."""
    noise, walk = UNITS[sensor]
    shown = held | ({"sigma"} if GAUSS_MARKOV in held else set())
    units = (noise, noise.replace("/sqrt(Hz)", ""), walk)
    return "; ".join(
        f"{', '.join(there)} in {unit}"
        for group, unit in zip(_COLUMNS, units, strict=True)
        if (there := [symbol for symbol in group if symbol in shown])
    )


def bound_lines(channels: Sequence[Json], consumer: Consumer, axes: str) -> list[str]:
    """Comments on bounds, which the file must leave bounds, on a sensor in motion, and on aliased white noise.

    Raises
    ------
    InputError
        A bound of terms that the file cannot say, or axes that are not bounded by the number.
    """
    lines = []
    for channel in channels:
        refuse_terms(channel["name"], channel["models"], consumer.terms)
        lines += bound_comments(plain_line(channel["name"]), channel["models"])
    if lines and axes == "rms":
        raise InputError(f"a bound of all axes is that of the worst one: axes='worst', not {axes!r}")
    lines += [line for c in channels for line in motion_comments(plain_line(c["name"]), c["models"])]
    return [*lines, *(line for c in channels for line in aliasing_comments(c))]


def number_format(digits: int) -> str:
    """The format of every number: a point, an exponent with its sign, two digits of it.

    YAML 1.1 takes 1e-3, 1.0e3 and 1E-3 for text, and Python's own `repr` writes such.
    """
    if isinstance(digits, bool) or not isinstance(digits, int) or not 3 <= digits <= 16:
        raise InputError(f"digits after the point must be 3 to 16, not {digits!r}")
    return f".{digits}e"


def rate_text(rate: float) -> str:
    """A rate that YAML 1.1 reads as a float: always a point, no bare exponent."""
    text = f"{rate:.6f}".rstrip("0")
    return (
        f"{rate:.6e}"
        if float(text) != rate and abs(float(text) / rate - 1) > 1e-6
        else text + "0" * text.endswith(".")
    )
