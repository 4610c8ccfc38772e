# SPDX-License-Identifier: BSD-3-Clause
"""Kinds of work that a page can ask for: each is a command of allanite, and lines of Python that do the same.

A job runs the command itself, so that the page, the command line and Python cannot come to different numbers. To add
a kind: one entry here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from allanite.commands.declaration import Command, Subject
from allanite.commands.option import ACCEPT, Option, option
from allanite.commands.page.options import Spelt, code_of, described
from allanite.commands.registry import COMMANDS
from allanite.lazy_dataclasses import dataclass

__all__ = ["KINDS", "JobKind", "described_kinds", "lines_of", "plan_lines"]

Takes = Subject | Literal["document", "model"]
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
    call = _planned("plan", model, spelt)
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


def _planned(name: str, model: str, spelt: Spelt) -> str:
    """A call that works on a noise model."""
    return _call(
        "commands.measure", [name], replace(spelt, arguments={"model": model, **spelt.arguments}), None
    )


def _declared_lines(kind: JobKind, subjects: Sequence[str], reading: Spelt, spelt: Spelt, out: str) -> str:
    logs = [list(subjects)] if kind.takes == "recordings" else subjects
    call = (
        _planned(kind.command, subjects[0], spelt)
        if kind.takes == "model"
        else _call("commands.measure", [kind.command, *logs], spelt, reading)
    )
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
    """The kind of work of a command that is declared; what it works on is no option."""
    models = command.takes == "model"
    options = [o for o in command.options if o.on_page and not (models and o.type == "model")]
    return JobKind(
        title=command.title,
        command=command.name,
        takes=command.takes,
        options={o.python: o for o in options},
        required=tuple(o.python for o in options if o.required),
        lines=_declared_lines,
        results=(f"{command.stem}.json", *command.documents),
        reads=not models,
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
            "lines": option("lines", "--lines", "Spectral lines to fit, by likelihood: auto, none, 12.3,50 [Hz]."),
            "accept": ACCEPT,
        },
        lines=_fit_lines,
        out="--output",
        results=("models.json",),
    ),
    **{name: _declared(command) for name, command in COMMANDS.items() if command.on_page},
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
