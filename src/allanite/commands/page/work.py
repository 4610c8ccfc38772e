# SPDX-License-Identifier: BSD-3-Clause
"""From a request to a piece of work: what is run, where its result goes, and the lines that would do the same."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

from allanite.commands.option import Option
from allanite.commands.page.catalogue import Catalogue, Document, Recorded
from allanite.commands.page.kinds import KINDS, JobKind, lines_of, plan_lines
from allanite.commands.page.options import READING, Spelt, checked, given_in, number_text
from allanite.commands.page.replies import Refused
from allanite.commands.page.settings import RESULTS, Settings
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass

__all__ = ["Work", "model_word", "path_word", "planned", "with_layout", "work_of"]

_MOST_RECORDINGS = 64
_LONGEST_WORDS = 500  # characters of a model in words


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """What a job does.

    Attributes
    ----------
    kind, title : str
    argv : tuple of str
        Words of the command after "allanite", to be run in `cwd`.
    python : str
    cwd : Path
    folder : Path or None
        Where the result goes; it must not be there yet.
    result : tuple of str
        Names of its document.
    lists : mapping of str to str
        Small tables to be written into `folder` first.
    recording : str or None
        Id of the recording it is of.
    series : mapping or None
        The task of preparing a series, in place of a command.
    keep : str or None
        Key under which the facts of a recording are kept.
    """

    kind: str
    title: str
    argv: tuple[str, ...] = ()
    python: str = ""
    cwd: Path
    folder: Path | None = None
    result: tuple[str, ...] = ()
    lists: Mapping[str, str] | None = None
    recording: str | None = None
    series: Mapping[str, Any] | None = None
    keep: str | None = None

    @property
    def command(self) -> str:
        """As it would be typed in the folder that is served."""
        return shlex.join(["allanite", *self.argv]) if self.argv else ""


def work_of(
    request: Mapping[str, Any], catalogue: Catalogue, settings: Settings, given_away: Collection[Path] = ()
) -> Work:
    """The work that a request asks for.

    Parameters
    ----------
    given_away : collection of Path
        Folders of other jobs, those that are removed again among them: no two jobs share a name.

    Raises
    ------
    Refused
        An unknown kind, option or id; what is missing.
    """
    name = request.get("kind")
    kind = KINDS.get(name) if isinstance(name, str) else None
    if kind is None or not isinstance(name, str):
        raise Refused(400, f"no kind of work {str(name)[:60]!r}; there are: {', '.join(KINDS)}")
    subjects_of = _subjects(kind, request, catalogue)
    consumer = _consumer(request.get("options")) if name == "export" else ""
    folder = _free(settings, _stem(subjects_of[0]), consumer or name, given_away)
    desk = _Desk(catalogue, settings, folder)
    subjects = [desk.word(getattr(place, "path", place)) for _, place, _ in subjects_of]
    reading = _reading(kind, request, [place for _, place, _ in subjects_of], desk)
    given = given_in(request, "options")
    missing = [option for option in kind.required if given.get(option) in (None, "", {})]
    if missing:
        raise Refused(400, f"{kind.title}: give {' and '.join(missing)}")
    spelt = checked(kind.options, given, desk.place)
    target = folder if kind.out == "--out" or not kind.out else folder / _file_of(name, consumer)
    argv = _argv(kind, subjects, reading, spelt, desk.word(target), consumer)
    of = subjects_of[0][2] if kind.takes == "recording" else None
    return Work(
        kind=name,
        title=_title(kind, [name for name, *_ in subjects_of]),
        argv=tuple(argv),
        python=lines_of(kind, [_plain(s) for s in subjects], reading, spelt, _plain(desk.word(target))),
        cwd=settings.folder,
        folder=folder,
        result=kind.results,
        lists=desk.lists,
        recording=None if of is None else of.id,
        keep=None if of is None else of.identity,
    )


def planned(
    request: Mapping[str, Any], catalogue: Catalogue, settings: Settings
) -> tuple[dict[str, Any], str]:
    """The task of a plan that somebody waits for, without a file; and its lines of Python."""
    desk = _Desk(catalogue, settings, settings.folder)
    word = desk.model(request.get("model"))
    given = given_in(request, "options")
    if given.get("latitude") is None:
        raise Refused(400, "Plan: give latitude")
    spelt = checked(KINDS["plan"].options, given, desk.place)
    command = shlex.join(["allanite", "plan", f"--model={word}", *spelt.words])
    task = {
        "task": "command", "cwd": str(settings.folder), "argv": ["plan", f"--model={word}", *spelt.words, "--json"],
        "command": command,
    }  # fmt: skip
    return task, plan_lines(_plain(word), spelt)


# -- pieces -----------------------------------------------------------------------------------------------


def _argv(
    kind: JobKind, subjects: Sequence[str], reading: Spelt, spelt: Spelt, target: str, consumer: str
) -> list[str]:
    words = [w for w in spelt.words if not w.startswith("=")]
    out = [f"{kind.out}={target}"] if kind.out else ["--json"]
    if kind.takes == "model":
        return [kind.command, f"--model={subjects[0]}", *words, *out]
    named = [consumer, *subjects] if consumer else list(subjects)
    return [kind.command, *named, *reading.words, *words, *out]


def _title(kind: JobKind, names: Sequence[str]) -> str:
    colon = "" if kind.title.endswith("?") else ":"
    return f"{kind.title}{colon} {', '.join(names)}"[:300]


def _reading(kind: JobKind, request: Mapping[str, Any], places: Sequence[Any], desk: _Desk) -> Spelt:
    """How the logs are read; one that a layout describes is read with it."""
    reading = checked(READING if kind.reads else {}, given_in(request, "read"), desk.place)
    layouts = {p.layout if isinstance(p, Recorded) else None for p in places} if kind.reads else {None}
    if len(layouts) > 1:
        raise Refused(400, "all logs share one layout: compare logs with the same layout")
    return with_layout(reading, layouts.pop(), desk.settings)


def with_layout(reading: Spelt, layout: Path | None, settings: Settings) -> Spelt:
    """Options of reading, with the file that describes the records of a raw binary log."""
    if layout is None:
        return reading
    word = path_word(layout, settings)
    arguments = {**reading.arguments, "layout": _plain(word)}
    return replace(reading, words=(*reading.words, f"--layout={word}"), arguments=arguments)


def _consumer(given: Any) -> str:
    from allanite.exporters import EXPORTERS

    known = [name.replace("_", "-") for name in EXPORTERS]
    if not isinstance(given, Mapping) or given.get("consumer") not in known:
        raise Refused(400, f"consumer must be one of {', '.join(known)}")
    return str(given["consumer"])


def _file_of(name: str, consumer: str) -> str:
    """Of a result that is a file."""
    if name != "export":
        return {"fit": "models.json", "report": "report.html"}[name]
    from allanite.exporters import exporter

    return exporter(consumer).FILE_NAME


def _subjects(
    kind: JobKind, request: Mapping[str, Any], catalogue: Catalogue
) -> list[tuple[str, Any, Recorded | None]]:
    """Name of what is worked on; itself, or a model; and its recording."""
    if kind.takes == "recording":
        one = catalogue.recording(request.get("recording"))
        return [(one.name, one, one)]
    if kind.takes == "document":
        document = catalogue.document(request.get("document"))
        return [(document.name, document, None)]
    if kind.takes == "model":
        return [("plan", request.get("model"), None)]
    ids = request.get("recordings")
    if not isinstance(ids, list) or not 2 <= len(ids) <= _MOST_RECORDINGS:
        raise Refused(400, f"recordings must be a list of 2 to {_MOST_RECORDINGS} recordings")
    return [(entry.name, entry, None) for entry in map(catalogue.recording_or_document, ids)]


def _stem(subject: tuple[str, Any, Any]) -> str:
    """What a result is called after: the recording, also that of a result."""
    name, entry, _ = subject
    source = entry.facts.get("source") if isinstance(entry, Document) else None
    return Path(source or name).name.split(".")[0]


def _free(settings: Settings, name: str, kind: str, given_away: Collection[Path]) -> Path:
    """A folder for the result that is not there yet: gyro-characterize, gyro-characterize-2, ..."""
    stem = re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-")[:60] or "record"
    above = (settings.folder if settings.writable else settings.cache) / RESULTS
    made = stem if stem == kind else f"{stem}-{kind}"
    places = (above / (made if n == 1 else f"{made}-{n}") for n in count(1))
    return next(place for place in places if place not in given_away and not os.path.lexists(place))


def _plain(word: str) -> str:
    return word.removeprefix("./")


class _Desk:
    """Turns ids, tables and models into words of a command."""

    def __init__(self, catalogue: Catalogue, settings: Settings, folder: Path) -> None:
        self.settings, self._catalogue, self._folder = settings, catalogue, folder
        self.lists: dict[str, str] = {}

    def word(self, place: Any) -> str:
        """A path as it would be typed in the folder that is served; a model as it is given."""
        return path_word(place, self.settings) if isinstance(place, Path) else self.model(place)

    def place(self, option: Option, name: str, value: Any) -> str:
        """The word for a value that is no plain text."""
        if option.type == "model":
            return self.model(value)
        if option.type == "recording":
            return self.word(self._catalogue.recording(value).path)
        if option.type == "document":
            return self.word(self._catalogue.document(value).path)
        file = f"{name}.csv"
        head = "start,stop" + (",heading" if option.type == "headings" else "")
        rows = "".join(",".join(map(number_text, map(float, row))) + "\n" for row in value)
        self.lists[file] = f"{head}\n{rows}"
        return self.word(self._folder / file)

    def model(self, value: Any) -> str:
        """A study or a model by its id, or a model in words."""
        return model_word(value, self._catalogue, self.settings)


def path_word(place: Path, settings: Settings) -> str:
    """A path as it would be typed in the folder that is served."""
    root = settings.folder
    text = str(place.relative_to(root)) if place.is_relative_to(root) else str(place)
    return f"./{text}" if text.startswith("-") else text


def model_word(value: Any, catalogue: Catalogue, settings: Settings) -> str:
    """The word for a study or a model by its id, or for a model in words.

    Raises
    ------
    Refused
        Neither.
    """
    if isinstance(value, Mapping) and isinstance(value.get("document"), str):
        return path_word(catalogue.document(value["document"]).path, settings)
    words = value.get("words") if isinstance(value, Mapping) else None
    if not isinstance(words, str) or "=" not in words or len(words) > _LONGEST_WORDS:
        raise Refused(400, 'model must be {"document": id} or {"words": "N=0.3 deg/√h, K=5 deg/h/√h"}')
    from allanite.study.model_file import model_of

    try:
        model_of(words)  # a command takes the name of a file as well
    except InputError as error:
        raise Refused(400, f"model must be words: {error}") from None
    if os.path.lexists(settings.folder / words):
        raise Refused(400, "a file has the name of this model: change the spacing of the model")
    return words
