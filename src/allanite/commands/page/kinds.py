# SPDX-License-Identifier: BSD-3-Clause
"""Kinds of work that a page can ask for: each is a command of allanite, and lines of Python that do the same.

A job runs the command itself, so that the page, the command line and Python cannot come to different numbers. To add
a kind: one entry here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, LATITUDE, SETUP, Option, option
from allanite.commands.page.options import Spelt, code_of, described
from allanite.commands.registry import COMMANDS

__all__ = ["KINDS", "JobKind", "described_kinds", "lines_of", "plan_lines"]

Takes = Literal["recording", "recordings", "document", "model"]
Lines = Callable[["JobKind", Sequence[str], Spelt, Spelt, str], str]


@dataclass(frozen=True, slots=True, kw_only=True)
class JobKind:
    """One kind of work.

    Attributes
    ----------
    title : str
        What the page calls it.
    command : str
        Of allanite.
    takes : str
        What it works on.
    options, required : mapping, tuple of str
    out : str
        Option that names the folder or the file of the result; "" where the result is what is printed.
    results : tuple of str
        Files of the result that hold its document; the first that is there is it.
    lines : callable
        Makes the Python.
    function : str
        Of `allanite.commands`.
    reads : bool
        The options of reading a log apply.
    """

    title: str
    command: str
    takes: Takes
    options: Mapping[str, Option]
    lines: Lines
    results: tuple[str, ...]
    required: tuple[str, ...] = ()
    out: str = "--out"
    function: str = ""
    reads: bool = True


def described_kinds() -> dict[str, Any]:
    """For the page."""
    return {
        name: {
            "title": k.title,
            "takes": k.takes,
            "reads": k.reads,
            "options": described(k.options),
            "required": list(k.required),
        }
        for name, k in KINDS.items()
    }


# -- Python -----------------------------------------------------------------------------------------------


def lines_of(kind: JobKind, subjects: Sequence[str], reading: Spelt, spelt: Spelt, out: str) -> str:
    """Lines of Python that do what the job does."""
    return _with_imports(kind.lines(kind, subjects, reading, spelt, out))


def plan_lines(model: str, spelt: Spelt) -> str:
    """Lines of Python that plan, without files."""
    call = _call("commands.plan_of", [model], spelt, None)
    return _with_imports(f"from allanite import commands\n\ndocument = {call}.plain")


def _with_imports(text: str) -> str:
    """The lines with what they use imported."""
    before = "import math\n\n" if "math." in text else ""
    after = "from allanite.quantities.units import parse_unit\n" if "parse_unit(" in text else ""
    head, _, rest = text.partition("\n\n")
    return f"{before}{head}\n{after}\n{rest}\n"


def _read(subject: str, reading: Spelt) -> str:
    """Lines that read a log as the commands do."""
    given = dict(reading.arguments)
    repair = given.pop("repair", None)
    text = f"recording = al.read({_arguments([subject], given)})"
    if repair:
        text = f"from allanite.recording.cleaning import clean\n\n{text}\n"
        text += f"recording = clean(recording, {code_of(repair)})"
    return text if repair else f"\n{text}"


def _arguments(positional: Sequence[Any], named: Mapping[str, Any]) -> str:
    return ", ".join([*map(code_of, positional), *(f"{k}={code_of(v)}" for k, v in named.items())])


def _call(function: str, positional: Sequence[Any], spelt: Spelt, reading: Spelt | None) -> str:
    """A call of a function of `allanite.commands`, with the options where it has them."""
    inside = {name: dict(values) for name, values in spelt.inside.items()}
    named = {**({} if reading is None else reading.arguments), **spelt.arguments}
    return f"{function}({_arguments(positional, {**named, **inside})})"


def _check_lines(kind: JobKind, subjects: Sequence[str], reading: Spelt, spelt: Spelt, out: str) -> str:
    return (
        f"import allanite as al\nfrom allanite.commands import describe\n{_read(subjects[0], reading)}\n"
        "facts = describe(recording, al.check(recording))"
    )


def _measured_lines(kind: JobKind, subjects: Sequence[str], reading: Spelt, spelt: Spelt, out: str) -> str:
    function = f"commands.{kind.function}"
    call = _call(function, subjects, spelt, reading if kind.reads else None)
    return (
        f"from allanite import commands\n\nmeasured = {call}\ncommands.write_measurement(measured, {out!r})"
    )


def _declared_lines(kind: JobKind, subjects: Sequence[str], reading: Spelt, spelt: Spelt, out: str) -> str:
    logs = [list(subjects)] if kind.takes == "recordings" else subjects
    call = _call("commands.measure", [kind.command, *logs], spelt, reading)
    return (
        f"from allanite import commands\n\nmeasured = {call}\ncommands.write_measurement(measured, {out!r})"
    )


def _fit_lines(kind: JobKind, subjects: Sequence[str], reading: Spelt, spelt: Spelt, out: str) -> str:
    call = _call("commands.fit_file", subjects, spelt, reading)
    return (
        "from allanite import commands\nfrom allanite.study.model_file import save_models\n\n"
        f"fitted = {call}\nsave_models(fitted.models, {out!r})"
    )


def _export_lines(kind: JobKind, subjects: Sequence[str], reading: Spelt, spelt: Spelt, out: str) -> str:
    named = dict(spelt.arguments)
    consumer = named.pop("consumer")
    return f"from allanite import commands\n\ncommands.export_of({_arguments([consumer, *subjects, out], named)})"


def _report_lines(kind: JobKind, subjects: Sequence[str], reading: Spelt, spelt: Spelt, out: str) -> str:
    return f"from allanite.views.report import render_file\n\nrender_file({_arguments([*subjects, out], {})})"


# -- options ----------------------------------------------------------------------------------------------


def _declared(command: Command) -> JobKind:
    """The kind of work of a command that is declared."""
    return JobKind(
        title=command.title,
        command=command.name,
        takes=command.takes,
        options={o.python: o for o in command.options if o.on_page},
        required=tuple(o.python for o in command.options if o.required),
        lines=_declared_lines,
        results=(f"{command.stem}.json", *command.documents),
    )


KINDS: Mapping[str, JobKind] = {
    "check": JobKind(
        title="Health of a recording",
        command="info",
        takes="recording",
        options={},
        lines=_check_lines,
        out="",
        results=("check.json",),
    ),
    "characterize": _declared(COMMANDS["characterize"]),
    "fit": JobKind(
        title="Fit other terms",
        command="fit",
        takes="recording",
        options={
            "method": option(
                "choice", "--method", "Fit method.", choices=("moments", "slopes", "likelihood", "spectral"),
                default="moments",
            ),
            "terms": option("text", "--terms", "Terms to fit, by likelihood or spectrum: NBK, NGGK."),
            "accept": ACCEPT,
        },
        lines=_fit_lines,
        out="--output",
        results=("models.json",),
    ),
    **{name: _declared(command) for name, command in COMMANDS.items() if command.on_page},
    "plan": JobKind(
        title="Plan",
        command="plan",
        takes="model",
        options={
            "latitude": LATITUDE,
            "channel": option("text", "--channel", "Channel whose model to use, if there are several."),
            "north": Option(type="flag", flag="--north", python="what", help="Plan a search for north."),
            "goal": option("number", "--goal", "One standard deviation: a share (0.03), or degrees with north."),
            "dead_time": option("seconds", "--dead-time", "Time lost at each turn.", default=2.0),
            "dwells": option("seconds-list", "--dwells", "Times between turns."),
            "durations": option("seconds-list", "--durations", "Record lengths."),
            "axes": option("integer", "--axes", "Number of horizontal axes, with north.", default=1),
            "positions": option("integer", "--positions", "Number of positions around the table, with north."),
            "misalignment": option("degrees", "--misalignment", "Misalignment of the axes on the table, with north."),
            **{o.python: o for o in SETUP},
        },
        required=("latitude",),
        lines=_measured_lines,
        function="plan_of",
        results=("plan.json",),
        reads=False,
    ),
    "export": JobKind(
        title="Export",
        command="export",
        takes="document",
        options={
            "consumer": Option(type="text", flag="", python="consumer", help="Target format."),
            "walk": option("text", "--walk", "Treatment of flicker: upper-bound, k-only or horizon=<seconds>."),
            "axes": option("choice", "--axes", "Value for three axes.", choices=("worst", "rms", "each")),
            "inflate": option("number", "--inflate", "Factor applied to all values."),
            "correlation_time": option(
                "seconds", "--correlation-time", "Correlation time of the term that replaces flicker."
            ),
            "gyroscope": option("names", "--gyroscope", "Gyroscope channels."),
            "accelerometer": option("names", "--accelerometer", "Accelerometer channels."),
            "digits": option("integer", "--digits", "Digits after the decimal point."),
            "rostopic": option("text", "--rostopic", "Topic of the IMU."),
            "part": option("text", "--part", "Name of the part in the JSON file."),
            "channel": option("text", "--channel", "Channel to export, for formats with one axis."),
            "filter_rate": option("number", "--filter-rate", "Update rate of the filter or simulator in Hz."),
            "scalar": option("choice", "--scalar", "Floating-point type of the filter.", choices=("float", "double")),
            "flicker": option("choice", "--flicker", "States that model flicker.", choices=("sum", "single")),
            "horizon": option("seconds", "--horizon", "Time over which the flicker model must hold."),
            "model": option("document", "--model", "Study with the noise."),
            "intrinsics": option("choice", "--intrinsics", "Convention of the intrinsic matrices.",
                choices=("kalibr", "rpng")),
            "rate": option("number", "--rate", "Sample rate of the log in Hz."),
            "overbound": option("number", "--overbound", "A bound above the sensor with this probability: 0.95."),
            "bound_until": option("seconds", "--bound-until", "Longest averaging time the bound covers."),
        },
        required=("consumer",),
        lines=_export_lines,
        out="--output",
        results=(),
        reads=False,
    ),
    "report": JobKind(
        title="Report",
        command="report",
        takes="document",
        options={},
        lines=_report_lines,
        out="--output",
        results=(),
        reads=False,
    ),
}  # fmt: skip
"""By name."""
