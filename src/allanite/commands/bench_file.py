# SPDX-License-Identifier: BSD-3-Clause
"""allanite.toml: what a bench knows of its logs and they do not say, stated once in place of an option each time.

    time = "t:ms"

    [scale_factor]
    ch1 = "24.0(2) mV/(deg/s)"

    [names]
    ch1 = "gyro_x"

The keys are options of reading. An option of the command goes before the file, for each channel. What was taken from
the file is a step of the history, the finding `bench_file` of every later result, and a note on the terminal.
"""

from __future__ import annotations

import hashlib
import os
import tomllib
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from allanite.commands.option import BENCH_FILE, READING, Option
from allanite.errors import DataQualityWarning, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.regular_file import read_regular

if TYPE_CHECKING:
    from allanite.recording.records import Recording

__all__ = ["FILE_NAME", "BenchFile", "bench_of", "read_bench"]

FILE_NAME: Final = "allanite.toml"
_NONE = "none"
_MOST = 1 << 20  # bytes
#: Of one log or one question, not of a bench; `sampling` has a default, and nobody could tell that it was given.
_OF_ONE_LOG = {"start", "stop", "repair", "sampling"}
_OPTIONS: Final[Mapping[str, Option]] = {o.python: o for o in READING if o.python not in _OF_ONE_LOG}
_KEYS: Final = (*_OPTIONS, "names")
#: Options that name channels, whose names in the log a bench may have replaced.
_BY_CHANNEL = ("unit", "scale_factor")


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchFile:
    """What a bench states.

    Attributes
    ----------
    path : Path
    sha256 : str
    options : mapping of str to Any
        Those of `read`.
    names : mapping of str to str
        Name in the log -> name in every result.
    """

    path: Path
    sha256: str
    options: Mapping[str, Any]
    names: Mapping[str, str]

    def read(self, log: Any, *, start: float | None, stop: float | None, **given: Any) -> Recording:
        """A log by what the bench states and, before that, by the options that were given.

        Raises
        ------
        InputError
            As of `read`, with the file that states the options; a name of no channel.
        """
        from allanite.files.readers import read
        from allanite.recording.health.log import words_of_bench

        given = self._by_names_of_log({name: value for name, value in given.items() if value is not None})
        left_open = ((name, _left_open(value, given.get(name))) for name, value in self.options.items())
        taken = {name: value for name, value in left_open if value is not None}
        options = given | {
            name: {**value, **given[name]} if name in given else value for name, value in taken.items()
        }
        try:
            recording = read(log, start=start, stop=stop, **options)
            recording = self._named(recording, by_choice="channels" in options)
        except InputError as error:
            raise InputError(
                f"{error} ({self.path} was taken into account; --config none leaves it out)"
            ) from None
        if not (stated := {**taken, **({"names": dict(self.names)} if self.names else {})}):
            return recording
        step = {"step": "bench_file", "file": str(self.path), "sha256": self.sha256, "stated": stated}
        warnings.warn(f"{recording.source}: {words_of_bench(step)}", DataQualityWarning, stacklevel=3)
        return replace(recording, history=(*recording.history, step))

    def _by_names_of_log(self, given: dict[str, Any]) -> dict[str, Any]:
        """Options whose channels have their names in the log, whichever of the two names was given."""
        former = {name: in_log for in_log, name in self.names.items()}
        if channels := given.get("channels"):
            given["channels"] = [former.get(name, name) for name in channels]
        for option in _BY_CHANNEL:
            if isinstance(by_channel := given.get(option), Mapping):
                given[option] = {former.get(name, name): value for name, value in by_channel.items()}
        return given

    def _named(self, recording: Recording, *, by_choice: bool) -> Recording:
        """The recording with the names of the bench; `by_choice` not all of its channels were read."""
        unknown = sorted(self.names.keys() - {*recording.names})
        if unknown and not by_choice:
            raise InputError(
                f"names: no channel {', '.join(unknown)} in {recording.source}; there are: "
                f"{', '.join(recording.names)}"
            )
        channels = tuple(replace(c, name=self.names.get(c.name, c.name)) for c in recording.channels)
        return replace(recording, channels=channels)


def bench_of(log: Any, config: str | os.PathLike[str] | None) -> BenchFile | None:
    """The bench file that a log is read by.

    Parameters
    ----------
    log : path
    config : path, optional
        A file, "none", or `BENCH_FILE`: the one beside the log, else the one in the working folder, if there is one.

    Raises
    ------
    InputError
        No such file, or one with a fault.
    """
    if config is None or config == _NONE:
        return None
    if config != BENCH_FILE:
        return read_bench(config)
    beside = Path(log).parent if isinstance(log, (str, os.PathLike)) else Path()
    for place in (beside / FILE_NAME, Path(FILE_NAME)):
        with suppress(OSError):  # a folder that may not be entered, a name that is too long: the log says so
            if place.is_file():
                return read_bench(place)
    return None


def read_bench(path: str | os.PathLike[str]) -> BenchFile:
    """Read a bench file.

    Raises
    ------
    InputError
        No such file, no TOML, an unknown key, a value of another kind.
    """
    try:
        content = read_regular(path, _MOST)
        table = tomllib.loads(content.decode("utf-8"))
    except OSError as error:
        raise InputError(
            f"{path} cannot be read: {error.strerror}: pass --config none, or name another file"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is no TOML: {error}") from None
    for key in table.keys() - {*_KEYS}:
        near = get_close_matches(key, _KEYS, n=1)
        meant = f"; did you mean {near[0]}?" if near else "."
        raise InputError(f"{path}: unknown key {key!r}{meant} The keys are: {', '.join(_KEYS)}")
    names = _texts(path, "names", table.pop("names", {}))
    if len({*names.values()}) < len(names):
        raise InputError(f"{path}: names gives one name to two channels; give each its own")
    return BenchFile(
        path=Path(path),
        sha256=hashlib.sha256(content).hexdigest(),
        options={key: _checked(path, key, value) for key, value in table.items()},
        names=names,
    )


def _checked(path: str | os.PathLike[str], key: str, value: Any) -> Any:
    """A value of the kind that its option takes."""
    option = _OPTIONS[key]
    if option.type == "by-channel" and isinstance(value, dict):
        return _texts(path, key, value)
    if option.type == "number":
        if isinstance(value, (int, float)) and not isinstance(value, bool) and value > 0:
            return float(value)
        raise InputError(f"{path}: {key} must be a positive number, not {value!r}")
    if option.type == "names":
        if isinstance(value, list) and value and all(isinstance(name, str) for name in value):
            return value
        raise InputError(f'{path}: {key} must be a list of names, ["gyro_x", "gyro_y"], not {value!r}')
    if not isinstance(value, str):
        table = " or a table of texts by channel" if option.type == "by-channel" else ""
        raise InputError(f"{path}: {key} must be a text{table}, not {value!r}")
    if option.type == "choice" and value not in option.choices:
        raise InputError(f"{path}: {key} must be one of {', '.join(option.choices)}, not {value!r}")
    return str(Path(path).parent / value) if option.type == "file" else value


def _texts(path: str | os.PathLike[str], key: str, value: Any) -> dict[str, str]:
    if not isinstance(value, dict):
        raise InputError(f"{path}: {key} must be a table: [{key}] and below it a line for each channel")
    for name, text in value.items():
        if not isinstance(text, str) or not text:
            raise InputError(f"{path}: {key}.{name} must be a text, not {text!r}")
    return value


def _left_open(stated: Any, given: Any) -> Any:
    """What an option leaves to the file: all where it was not given, and the channels of which it says nothing."""
    if given is None:
        return stated
    if isinstance(stated, Mapping) and isinstance(given, Mapping):
        return {name: value for name, value in stated.items() if name not in given} or None
    return None
