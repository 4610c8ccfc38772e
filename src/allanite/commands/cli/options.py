# SPDX-License-Identifier: BSD-3-Clause
"""Kinds of options, and the options that several commands share."""

from __future__ import annotations

import json
import math
import re
import shlex
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import click

from allanite.commands.cli.completion import complete_files, complete_findings
from allanite.commands.cli.repeated import Listed
from allanite.commands.option import (
    ACCEPT,
    BENCH,
    BENCH_FILE,
    CONFIDENCE,
    FLOOR,
    READING,
    STATISTICS,
    Option,
)
from allanite.commands.option import MODEL as _MODEL

if TYPE_CHECKING:
    from allanite.quantities.units import QuantityKind

__all__ = [
    "ENGINES",
    "MODEL",
    "Acceleration",
    "Aim",
    "Angle",
    "ByChannel",
    "Duration",
    "Durations",
    "FindingCode",
    "Frequencies",
    "GSensitivity",
    "Goal",
    "Goals",
    "Lags",
    "Latitude",
    "Names",
    "Numbers",
    "Rate",
    "Share",
    "accept_option",
    "click_option",
    "confidence_option",
    "floor_option",
    "force_option",
    "in_si",
    "json_option",
    "log_options",
    "place_of",
    "print_json",
    "seed_option",
    "statistic_option",
    "typed",
    "with_options",
]

MODEL = _MODEL.help
ENGINES = ("exact", "decimated", "auto")
_MOST_RADIANS = 1.6
"""A latitude below this in degrees may be one in radians: half of pi is 1.571."""
_SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0, "d": 86400.0, "w": 604800.0}


def in_si(text: str, quantity: QuantityKind, unit: str = "") -> float:
    """A number with its unit in SI; with `unit`, if that is given, where it has none.

    Raises
    ------
    InputError
        No number, no unit, or one of another quantity.
    """
    from allanite.errors import InputError
    from allanite.quantities.units import parse_unit

    words = text.strip().replace("−", "-")
    parts = re.fullmatch(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d.].*)?", words, re.S)
    if parts is None or not (parts[2] or unit):
        raise InputError("write a number with its unit, as in 1deg or 10deg/h")
    return float(parts[1]) * parse_unit(parts[2] or unit, quantity).factor


class Duration(click.ParamType[Any]):
    """A time span: seconds, or a number with ms, s, min, h, d or w."""

    name = "duration"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, (int, float)):
            return float(value)
        number, unit = re.fullmatch(r"(.*?)\s*([a-z]*)", str(value).strip(), re.S).groups()  # type: ignore[union-attr]
        try:
            return float(number) * _SECONDS[unit]
        except (KeyError, ValueError):
            self.fail(f"{value!r} is not a time span: write 3600, 90s, 30min, 12h or 7d", param, ctx)


class ByChannel(Listed):
    """One text for all channels, or one for each name or group: gyro=deg/s,acc=g."""

    name = "unit"
    parts = "mapping"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> str | dict[str, str]:
        if isinstance(value, dict) or "=" not in value:
            return value
        parts = [part.split("=", 1) for part in value.split(",")]
        if any(len(part) != 2 or not all(p.strip() for p in part) for part in parts):
            self.fail(f"{value!r}: write one unit for all channels, or gyro=deg/s,acc=g", param, ctx)
        return {name.strip(): unit.strip() for name, unit in parts}


class PerLog(Listed):
    """One value for all logs, or one for each: a.csv=100,b.csv=50."""

    parts = "mapping"

    def __init__(self, kind: click.ParamType[Any]) -> None:
        self.kind = kind
        self.name = kind.name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str) or not Path(value.partition("=")[0]).exists():
            return value if isinstance(value, dict) else self.kind.convert(value, param, ctx)
        parts = [part.partition("=") for part in value.split(",")]
        return {log.strip(): self.kind.convert(text.strip(), param, ctx) for log, _, text in parts}


class Renamed(Listed):
    """Names of the log with those of the model: wx=gyro_x,wy=gyro_y."""

    name = "names"
    parts = "mapping"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> dict[str, str]:
        if isinstance(value, dict):
            return value
        parts = [[word.strip() for word in part.split("=")] for part in value.split(",")]
        if any(len(part) != 2 or not all(part) for part in parts):
            self.fail(
                f"{value!r}: write the name in the log, =, and that of the model: wx=gyro_x,wy=gyro_y",
                param,
                ctx,
            )
        names = {part[0]: part[1] for part in parts}
        if len(names) < len(parts):
            self.fail(f"{value!r} names a channel of the log twice", param, ctx)
        return names


class Names(Listed):
    """Names with commas between them."""

    name = "names"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> list[str]:
        return (
            value if isinstance(value, list) else [part.strip() for part in value.split(",") if part.strip()]
        )


class Lags(click.ParamType[Any]):
    "octave, decade, all, a number per decade, or a comma-separated list of averaging times."

    name = "lags"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value in ("octave", "decade", "all") or not isinstance(value, str):
            return value
        try:
            times = [float(part) for part in value.split(",")]
        except ValueError:
            self.fail(
                f"{value!r}: write octave, decade, all, a count per decade, or times like 0.1,1,10",
                param,
                ctx,
            )
        return int(times[0]) if len(times) == 1 and value.isdigit() else times


class Spans(Listed):
    """Spans of time with commas between them: 0.1:0.5,100:1000."""

    name = "spans"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[tuple[float, float]]:
        if isinstance(value, (list, tuple)):
            return list(value)
        spans = []
        for part in value.split(","):
            ends = [Duration()(end, param, ctx) for end in part.split(":")]
            if len(ends) > 2:
                self.fail(f"{part!r}: write from:to, or one time", param, ctx)
            spans.append((ends[0], ends[-1]))
        return spans


class Numbers(Listed):
    """Whole numbers from 1, and pairs of them, with commas between: 7,12-13."""

    name = "numbers"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int | tuple[int, int], ...]:
        if isinstance(value, tuple):
            return value
        numbers: list[int | tuple[int, int]] = []
        for word in str(value).split(","):
            ends = [int(end) if end.strip().isdecimal() else 0 for end in word.split("-")]
            if len(ends) > 2 or min(ends) < 1:
                self.fail(
                    f"{value!r} are no numbers of positions: write 7 or 7,12, and 7-8 for a turn", param, ctx
                )
            numbers.append((ends[0], ends[1]) if len(ends) == 2 else ends[0])
        return tuple(numbers)


class Durations(Listed):
    """Time spans with commas between them."""

    name = "durations"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> list[float]:
        return (
            value if isinstance(value, list) else [Duration()(part, param, ctx) for part in value.split(",")]
        )


class Aim(float):
    """A goal: a share, or an angle [rad]."""

    is_angle: bool

    def __new__(cls, value: float, is_angle: bool) -> Aim:
        aim = super().__new__(cls, value)
        aim.is_angle = is_angle
        return aim


class Goal(click.ParamType[Any]):
    """A share (3% or 0.03), or an angle with its unit (1deg)."""

    name = "goal"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Aim:
        if isinstance(value, Aim):
            return value
        text = str(value).strip()
        if re.search(r"deg|rad|arc|°", text):
            return Aim(Angle()(text, param, ctx), True)
        share = Share()(text, param, ctx)
        if share >= 1.0 and not text.endswith(("%", "ppm")):
            self.fail(
                f"{text!r} alone would be {100 * share:g} %: write {text}% or {share / 100:g}; with --north {text}deg",
                param,
                ctx,
            )
        return Aim(share, False)


class Goals(Listed):
    """Wanted standard deviations: gyro.scale=0.1%,accelerometer.bias=1mg; or an angle for a heading: 1deg."""

    name = "goals"
    parts = "mapping"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        if "=" not in value:
            return Angle()(value, param, ctx)
        out = {}
        for part in value.split(","):
            name, _, size = (text.strip() for text in part.partition("="))
            sensor, _, rest = name.partition(".")
            if sensor not in ("gyro", "accelerometer") or not rest or not size:
                self.fail(f"{part!r}: write gyro.scale=0.1%, or accelerometer.bias_x=1mg", param, ctx)
            out[name] = self._size(sensor, rest.partition("_")[0], size, param, ctx)
        return out

    def _size(
        self, sensor: str, kind: str, text: str, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        of_bias = Rate() if sensor == "gyro" else Acceleration()
        kinds = {"scale": Share(), "misalignment": Angle(), "bias": of_bias}
        if kind not in kinds:
            self.fail(f"{kind!r} is not one of bias, scale and misalignment", param, ctx)
        return float(kinds[kind](text, param, ctx))


class Initial(Listed):
    """Standard deviations at the start: tilt=0.1deg,heading=1deg,gyro.bias=10deg/h,accelerometer.bias=1mg."""

    name = "initial"
    parts = "mapping"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        from allanite.errors import InputError
        from allanite.experiments.dead_reckoning import InitialErrors

        sizes = {}
        for part in value.split(","):
            name, _, text = (word.strip() for word in part.partition("="))
            try:
                sizes[name.replace(".", "_")] = in_si(text, self._quantity(name, param, ctx))
            except InputError as error:
                self.fail(f"{name}={text}: {error}", param, ctx)
        try:
            return InitialErrors(**sizes)
        except InputError as error:
            self.fail(str(error), param, ctx)

    def _quantity(self, name: str, param: click.Parameter | None, ctx: click.Context | None) -> QuantityKind:
        from allanite.quantities.units import QuantityKind

        quantities = {
            "position": QuantityKind.LENGTH,
            "velocity": QuantityKind.VELOCITY,
            "tilt": QuantityKind.ANGLE,
            "heading": QuantityKind.ANGLE,
            "gyro.bias": QuantityKind.ANGLE_RATE,
            "accelerometer.bias": QuantityKind.ACCELERATION,
            **{f"{s}.scale": QuantityKind.RATIO for s in ("gyro", "accelerometer")},
            **{f"{s}.misalignment": QuantityKind.ANGLE for s in ("gyro", "accelerometer")},
        }
        if name not in quantities:
            self.fail(f"{name!r} is not an initial error; there are: {', '.join(quantities)}", param, ctx)
        return quantities[name]


class Angle(click.ParamType[Any]):
    """An angle: degrees, or a number with deg, rad, mrad or arcmin; S and W are negative."""

    name = "angle"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, (int, float)):
            return float(value)
        from allanite.quantities.units import QuantityKind

        words = str(value).strip()
        text, side = re.fullmatch(r"(.*?)\s*([NSEW]?)", words, re.S).groups()  # type: ignore[union-attr]
        try:
            size = in_si(text, QuantityKind.ANGLE, "deg")
        except ValueError:
            self.fail(f"{value!r} is not an angle: write -23.31, 23.31S, 0.1deg or 2mrad", param, ctx)
        if side in ("S", "W"):
            return -abs(size)  # the sign and the letter say the same
        if side and size < 0:
            self.fail(f"{value!r} has both a minus sign and {side}: use one of them", param, ctx)
        return size


class Latitude(Angle):
    """An angle from the south pole to the north pole: degrees, south negative or with an S."""

    name = "latitude"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        latitude = super().convert(value, param, ctx)
        text = str(value).strip()
        if text.endswith(("E", "W")):
            self.fail(f"{value!r} is a longitude: a latitude is north or south, like 23.31S", param, ctx)
        if not abs(latitude) <= 0.5 * math.pi * (1 + 1e-12):
            self.fail(f"{value!r} is beyond a pole: latitudes go from -90 to 90 degrees", param, ctx)
        self._note(text, latitude)
        return latitude

    def _note(self, text: str, latitude: float) -> None:
        """A bare number that small may have been meant in radians."""
        bare = re.fullmatch(r"[-+−]?[\d.]+(?:[eE][-+−]?\d+)?", text)
        if bare and 0 < abs(math.degrees(latitude)) < _MOST_RADIANS:
            meant = math.degrees(math.degrees(latitude))
            click.echo(
                f"allanite: note: latitude {text} is taken as degrees, close to the equator; in radians it would be "
                f"{meant:.2f} deg: write {text}rad for that, or {text}deg to be without this note",
                err=True,
            )


class _WithUnit(click.ParamType[Any]):
    """A number with its unit."""

    quantity: ClassVar[str]
    wanted: ClassVar[str]

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, (int, float)):
            return float(value)
        from allanite.quantities.units import QuantityKind

        try:
            return in_si(str(value), QuantityKind[self.quantity])
        except ValueError:
            self.fail(f"{value!r} is no {self.wanted}", param, ctx)


class Rate(_WithUnit):
    """A rate of rotation with its unit: 15.041deg/h, 6deg/s."""

    name = "rate"
    quantity = "ANGLE_RATE"
    wanted = "rate of rotation: write 15.041deg/h or 0.00418deg/s"


class GSensitivity(_WithUnit):
    """What gravity adds to a rate, with its unit: 0.1deg/h/g."""

    name = "rate per g"
    quantity = "GYRO_G"
    wanted = "g-sensitivity: write 0.1deg/h/g or 0.01deg/s/g"


class Acceleration(_WithUnit):
    """An acceleration with its unit: 1mg, 50ug, 0.01m/s^2."""

    name = "acceleration"
    quantity = "ACCELERATION"
    wanted = "acceleration: write 1mg, 50µg or 0.01m/s^2"


class Share(click.ParamType[Any]):
    """A part of a whole: 3%, 500ppm or 0.03."""

    name = "share"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, (int, float)):
            return float(value)
        number, unit = re.fullmatch(r"(.*?)\s*(%|ppm|)", str(value).strip(), re.S).groups()  # type: ignore[union-attr]
        try:
            return float(number) * {"": 1.0, "%": 1e-2, "ppm": 1e-6}[unit]
        except ValueError:
            self.fail(f"{value!r} is not a fraction: write 3%, 500ppm or 0.03", param, ctx)


class Frequencies(Listed):
    """Spectral lines: auto (the steady ones of the spectrum), none, or frequencies in Hz like 12.3,50."""

    name = "lines"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "auto" or not isinstance(value, str):
            return value
        try:
            return [] if value == "none" else [float(part) for part in value.split(",")]
        except ValueError:
            self.fail(f"{value!r}: write auto, none, or frequencies in Hz like 12.3,50", param, ctx)


class FindingCode(click.ParamType[Any]):
    """Code of a finding."""

    name = "finding"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        from allanite.recording.health.catalogue import CATALOGUE

        if value not in CATALOGUE:
            self.fail(f"no finding named {value!r}; there are: {', '.join(CATALOGUE)}", param, ctx)
        return str(value)


def log_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """What every command that reads a log understands."""
    bench = click.option(
        BENCH.flag,
        metavar=BENCH.metavar,
        default=BENCH_FILE,
        envvar="ALLANITE_CONFIG",
        shell_complete=complete_files,
        help=f"{BENCH.help}  [default: {BENCH.otherwise}]",
    )
    return with_options(READING)(bench(command))


def floor_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """The instrument's own noise."""
    return click_option(FLOOR)(command)


def confidence_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Of intervals."""
    return click_option(CONFIDENCE)(command)


def seed_option(default: int) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Of what is simulated."""
    text = "Random seed; the same seed gives the same samples."
    return click.option("--seed", type=int, default=default, show_default=True, help=text)


def force_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Files are not replaced without being asked to."""
    return click.option("--force", is_flag=True, help="Overwrite existing files.")(command)


def accept_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Fatal findings are refused, one by one."""
    return click_option(ACCEPT)(command)


def statistic_option(what: str, *more: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Which deviation, or which of `more`."""
    kind, text = click.Choice((*STATISTICS, *more)), f"{what}: {', '.join((*STATISTICS, *more))}."
    return click.option(
        "--statistic", type=kind, metavar="NAME", default="oadev", show_default=True, help=text
    )


def json_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """For programs that read what we print."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON only, on stdout.")(command)


# -- options that are declared ------------------------------------------------------------------------------

_KINDS: dict[str, click.ParamType[Any]] = {
    "number": click.FLOAT,
    "integer": click.INT,
    "share": Share(),
    "names": Names(),
    "findings": FindingCode(),
    "by-channel": ByChannel(),
    "recording": click.Path(exists=True),
    "study": click.Path(exists=True, dir_okay=False, allow_dash=True),
    "spans": Spans(),
    "numbers": Numbers(),
    "goal": Goal(),
    "goals": Goals(),
    "initial": Initial(),
    "seconds-list": Durations(),
    "lines": Frequencies(),
    "seconds": Duration(),
    "degrees": Angle(),
    "latitude": Latitude(),
    "deg/h": Rate(),
    "deg/s": Rate(),
    "acceleration": Acceleration(),
    "renamed": Renamed(),
    "deg/h/g": GSensitivity(),
    "file": click.Path(exists=True, dir_okay=False),
    "place": click.Path(exists=True),
    "turns": click.Path(exists=True, dir_okay=False),
    "headings": click.Path(exists=True, dir_okay=False),
}
"""Type of an `Option` -> that of the command line; any other is text."""
_COMPLETED = {
    "findings": complete_findings,
    **dict.fromkeys(("model", "models", "log", "document", "description"), complete_files),
}
"""Type of an `Option` that is text -> what a shell completes it by."""


def click_option(
    declared: Option, *, asked_later: bool = False
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """An option as the command line takes it; one that is required may be `asked_later`, by the command itself."""
    kind = (
        click.Choice(declared.choices)
        if declared.type == "choice"
        else _KINDS.get(declared.type, click.STRING)
    )
    more: dict[str, Any] = {}
    if declared.type in ("texts", "findings", "models"):
        more["multiple"] = True
    if declared.default is not None:
        shown = f"{100 * declared.default:g}%" if declared.type == "share" else declared.default
        more |= {"default": shown, "show_default": True}
    if declared.metavar:
        more["metavar"] = declared.metavar
    if declared.required and not asked_later:
        more["required"] = True
    if declared.type == "flag":
        more |= {"is_flag": True, "default": None} if "/" in declared.flag else {"is_flag": True}
    else:
        more["type"] = PerLog(kind) if declared.per_log else kind
    if declared.type in _COMPLETED:
        more["shell_complete"] = _COMPLETED[declared.type]
    text = declared.help.removesuffix(".") + " (repeatable)." if "multiple" in more else declared.help
    if declared.detail:
        text = f"{text.removesuffix('.')}: {declared.detail}."
    if declared.otherwise:
        text += f"  [default: {declared.otherwise}]"
    if declared.required and asked_later:
        text += "  [required]"
    return click.option(declared.flag, declared.python, help=text, **more)


def with_options(
    options: Iterable[Option], *, asked_later: bool = False
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """A command with options, in their order; see `click_option`."""

    def bundled(command: Callable[..., Any]) -> Callable[..., Any]:
        for declared in reversed(tuple(options)):
            command = click_option(declared, asked_later=asked_later)(command)
        return command

    return bundled


def place_of(name: str) -> Path:
    """A path; for "-" a file named stdin that holds what came through it, as long as the command runs."""
    if name != "-":
        return Path(name)
    folder = tempfile.TemporaryDirectory(prefix="allanite.")
    click.get_current_context().call_on_close(folder.cleanup)
    place = Path(folder.name) / "stdin"
    with place.open("wb") as file:
        shutil.copyfileobj(sys.stdin.buffer, file)
    return place


def typed() -> str:
    """The command as it was typed."""
    return shlex.join(["allanite", *sys.argv[1:]])


def print_json(data: Any) -> None:
    click.echo(json.dumps(data, ensure_ascii=False, indent=1))
