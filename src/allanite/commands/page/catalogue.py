# SPDX-License-Identifier: BSD-3-Clause
"""What lies in the folder that is served: recordings, runs and results, each under an id.

An id is made here and is looked up here; no request holds a path. Links are followed only where they stay inside the
folder. What a file holds is known once it was opened or checked, by its identity: size, time and both ends.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import threading
from collections.abc import Iterator, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from allanite.commands.page.bounds import is_inside
from allanite.commands.page.options import asked_for
from allanite.commands.page.replies import Refused
from allanite.commands.page.settings import RESULTS, Settings
from allanite.commands.page.sniffing import (
    HEAD,
    describes_frames,
    document_format,
    layout_beside,
    recording_format,
)
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.json_values import parse_plain
from allanite.plain_files.regular_file import open_regular, read_regular_text
from allanite.stability.fleet.table_files import TABLE

__all__ = ["Catalogue", "Document", "Recorded", "health_of", "utc"]

Json = Mapping[str, Any]

_ID = re.compile(r"[0-9a-f]{24}")
_END = 64 << 10  # bytes of both ends that tell a file
_SKIPPED = frozenset({"__pycache__", "node_modules", "site-packages"})
#: Files beside a result that belong to it.
_BESIDE = frozenset(
    {
        ".csv", ".yaml", ".yml", ".html", ".pdf", ".svg", ".png", ".json", ".hpp", ".txt", ".m", ".sdf", ".param",
    }
)  # fmt: skip
#: Tables that commands leave beside a result; they look like logs, and are none.
_TABLES = frozenset(
    {
        "check.csv", "coefficients.csv", "datasheet.csv", "difference.csv", "dwells.csv", "errors.csv", "inflation.csv",
        "lots.csv", "parameters.csv", "plan.csv", "points.csv", "positions.csv", "selection.csv", "separation.csv",
        "spectrum.csv", "standing_out.csv", "stands.csv", "steps.csv", "stretches.csv", "variation.csv", "weights.csv",
    }
)  # fmt: skip
_SEVERITIES = ("fatal", "warning", "info")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Listed:
    """A file in the folder, or the folder of a run.

    Attributes
    ----------
    id, name : str
        The name is the path below the folder, to be shown.
    path : Path
    format : str
    size : int [bytes]
    modified : float [s]
    """

    id: str
    name: str
    path: Path
    format: str
    size: int
    modified: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Recorded(_Listed):
    """A recording in the folder.

    Attributes
    ----------
    identity : str
        Changes when the file does, or its layout.
    layout : Path or None
        The file that describes the records of a raw binary log.
    """

    identity: str
    layout: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Document(_Listed):
    """A result in the folder; `facts` is what the list shows of it."""

    facts: Json


class Catalogue:
    """The files of a folder; `scan` looks at it anew."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._lock = threading.Lock()
        self._recordings: dict[str, Recorded] = {}
        self._documents: dict[str, Document] = {}
        self._descriptions: dict[str, _Listed] = {}
        self._heads: dict[Path, tuple[tuple[int, int], bytes, str]] = {}
        self._read: dict[Path, tuple[tuple[int, int], Json]] = {}
        self._made_from: dict[Path, str] = {}  # document -> id of its recording
        self.truncated = False
        self.scanned = ""

    # -- ids --------------------------------------------------------------------------------------------------

    def recording(self, given: object) -> Recorded:
        """The recording with this id, as it lies in the folder now.

        Raises
        ------
        Refused
            There is none.
        """
        recorded: Recorded = self._checked(self._recordings, given, "recording")
        return recorded

    def document(self, given: object) -> Document:
        """The result with this id."""
        document: Document = self._checked(self._documents, given, "document")
        if document.size > self._settings.limits.document:
            raise Refused(413, f"{document.name} is too large to be shown: {document.size >> 20} MiB")
        return document

    def description(self, given: object) -> _Listed:
        """The description of a serial device with this id."""
        description: _Listed = self._checked(self._descriptions, given, "description of frames")
        return description

    def recording_or_document(self, given: object) -> Recorded | Document:
        """Either, by its id."""
        if isinstance(given, str) and given in self._documents:
            return self.document(given)
        return self.recording(given)

    def _checked(self, known: Mapping[str, Any], given: object, what: str) -> Any:
        listed = known.get(given) if isinstance(given, str) and _ID.fullmatch(given) else None
        if listed is None or not is_inside(listed.path, self._settings) or not listed.path.exists():
            raise Refused(404, f"no {what} with this id: reload the list")
        return listed

    def id_of(self, path: Path) -> str:
        """The id of a file; the same file has the same id as long as the server runs."""
        return self._settings.id_of(path)

    # -- looking ----------------------------------------------------------------------------------------------

    def scan(self) -> Json:
        """Look at the folder anew; plain data of all that is in it."""
        with self._lock:
            self._look()
            return self.to_json()

    def add(self, path: Path) -> Json:
        """A file that has come; plain data of it.

        Raises
        ------
        Refused
            It is no recording.
        """
        self.scan()
        with self._lock:
            recorded = self._recordings.get(self.id_of(path))
            if recorded is None:
                raise Refused(400, "this file does not look like a recording that allanite reads")
            return self._recording_json(recorded, [])

    def link(self, document: Path, recording: str | None) -> None:
        """Remember what a result was made from."""
        if recording is not None:
            self._made_from[document] = recording

    def _look(self) -> None:
        recordings: dict[str, Recorded] = {}
        documents: dict[str, Document] = {}
        descriptions: dict[str, _Listed] = {}
        self.truncated, most = False, self._settings.limits.files
        for path, entry in self._walk(self._settings.folder, 0):
            if len(recordings) + len(documents) >= most:
                self.truncated = True
                break
            with suppress(OSError, InputError):  # gone, not ours to read, or a pipe by now
                self._sort(path, entry, recordings, documents, descriptions)
        for path in self._elsewhere():
            with suppress(OSError, InputError):
                self._sort(path, path.stat(), {}, documents, {})
        beside = {d.path.parent for d in documents.values()}
        self._recordings = {
            key: r
            for key, r in recordings.items()
            if r.path.name not in _TABLES or r.path.parent not in beside
        }
        self._documents, self._descriptions = documents, descriptions
        self.scanned = utc(datetime.now(UTC).timestamp())

    def _elsewhere(self) -> Iterator[Path]:
        """Results of a folder that cannot be written."""
        place = self._settings.cache.resolve() / RESULTS
        if not self._settings.writable and place.is_dir():
            yield from place.glob("*/*.json")

    def _sort(
        self,
        path: Path,
        stat: os.stat_result,
        recordings: dict[str, Recorded],
        documents: dict[str, Document],
        descriptions: dict[str, _Listed],
    ) -> None:
        key = self.id_of(path)
        head, identity = self._head(path, stat)
        root = self._settings.folder
        name = str(path.relative_to(root)) if path.is_relative_to(root) else f"{path.parent.name}/{path.name}"
        kind = document_format(path, head) if path.is_file() else None
        if kind is not None:
            documents[key] = Document(
                id=key, name=_shown(name), path=path, format=kind, size=stat.st_size, modified=stat.st_mtime,
                facts=self._facts_of(path, stat, kind),
            )  # fmt: skip
            return
        if path.is_relative_to(root / RESULTS):
            return
        if path.is_file() and describes_frames(path):
            descriptions[key] = _Listed(
                id=key,
                name=_shown(name),
                path=path,
                format="description",
                size=stat.st_size,
                modified=stat.st_mtime,
            )
        form, layout = recording_format(path, head), None
        if form is None and (layout := self._layout(path)) is not None:
            form, known = "raw_binary", layout.stat()
            mark = f"{identity} {known.st_size} {known.st_mtime_ns}"
            identity = hashlib.sha256(mark.encode()).hexdigest()[:32]
        if form is None and path == self._settings.log:
            form = "text"  # somebody named it: its reader decides
        if form is not None:
            recordings[key] = Recorded(
                id=key, name=_shown(name), path=path, format=form, size=_size(path, stat),
                modified=_modified(path, stat), identity=identity, layout=layout,
            )  # fmt: skip

    def _layout(self, path: Path) -> Path | None:
        layout = layout_beside(path)
        return layout if layout is not None and is_inside(layout, self._settings) else None

    def _walk(self, folder: Path, depth: int) -> Iterator[tuple[Path, os.stat_result]]:
        try:
            entries = sorted(os.scandir(folder), key=lambda e: e.name)
        except OSError:
            return
        for entry in entries:
            if entry.name.startswith(".") or entry.name in _SKIPPED:
                continue
            path = Path(entry.path)
            try:
                if entry.is_symlink() and not is_inside(path, self._settings):
                    continue
                stat = entry.stat()
                if entry.is_dir():
                    if recording_format(path, b"") is not None:
                        if is_inside(path, self._settings):
                            yield path, stat
                    elif depth < self._settings.limits.depth and not entry.is_symlink():
                        yield from self._walk(path, depth + 1)
                elif entry.is_file() and stat.st_size:
                    yield path, stat
            except OSError:
                continue

    def _head(self, path: Path, stat: os.stat_result) -> tuple[bytes, str]:
        """The first bytes of a file, and its identity."""
        if path.is_dir():
            return b"", _folder_identity(path)
        mark = (stat.st_size, stat.st_mtime_ns)
        known = self._heads.get(path)
        if known is None or known[0] != mark:
            with open_regular(path) as file:
                first = file.read(_END)
                file.seek(max(stat.st_size - _END, 0))
                last = file.read(_END)
            digest = hashlib.sha256(
                f"{path} {mark}".encode(errors="surrogateescape") + first + last
            ).hexdigest()
            known = self._heads[path] = (mark, first[:HEAD], digest[:32])
        return known[1], known[2]

    def _facts_of(self, path: Path, stat: os.stat_result, kind: str) -> Json:
        """What a result says of itself; it is read once."""
        mark = (stat.st_size, stat.st_mtime_ns)
        known = self._read.get(path)
        if known is None or known[0] != mark:
            known = self._read[path] = (mark, _said(path, stat.st_size, self._settings.limits.document, kind))
        return known[1]

    # -- what is known of a recording ----------------------------------------------------------------------------

    def keep(self, identity: str, what: str, facts: Json) -> None:
        """Keep what was found out of a recording, or said of it: "facts", "health", "refused", "removed"."""
        folder = self._settings.cache / "known"
        folder.mkdir(parents=True, exist_ok=True)
        place = folder / f"{identity}-{what}.json"
        made = place.with_suffix(f".{os.getpid()}-{threading.get_ident()}")
        made.write_text(json.dumps(facts, ensure_ascii=False), encoding="utf-8")
        made.replace(place)

    def known(self, identity: str, what: str) -> Json | None:
        """What was kept."""
        try:
            content = json.loads(
                (self._settings.cache / "known" / f"{identity}-{what}.json").read_text(encoding="utf-8")
            )
        except (OSError, ValueError):
            return None
        return content if isinstance(content, dict) else None

    # -- plain data -------------------------------------------------------------------------------------------

    def to_json(self) -> Json:
        """For the page."""
        by_recording: dict[str, list[str]] = {}
        documents = []
        for d in self._documents.values():
            of = self._made_from.get(d.path) or self._by_source(d)
            if of is not None:
                by_recording.setdefault(of, []).append(d.id)
            documents.append(self.document_json(d, of))
        return {
            "folder": _shown(self._settings.folder.name or "/"),
            "scanned": self.scanned,
            "truncated": self.truncated,
            "recordings": [
                self._recording_json(r, by_recording.get(r.id, [])) for r in self._recordings.values()
            ],
            "documents": documents,
            "descriptions": [{"id": d.id, "name": d.name} for d in self._descriptions.values()],
        }

    def _by_source(self, document: Document) -> str | None:
        """The one recording that has the name which the result names as its source."""
        source = document.facts.get("source")
        same = [r.id for r in self._recordings.values() if source and r.path.name == source]
        return same[0] if len(same) == 1 else None

    def _recording_json(self, r: Recorded, documents: list[str]) -> dict[str, Any]:
        health = self.known(r.identity, "health") or self._health_of_study(documents)
        refused = (self.known(r.identity, "refused") or {}).get("message")
        return {
            "id": r.id, "name": r.name, "format": r.format, "size": r.size, "modified": utc(r.modified),
            "is_run": r.path.is_dir() and r.format == "run", "is_fleet": r.path.name == TABLE,
            "status": _status(r.path) if r.path.is_dir() and r.format == "run" else None,
            "facts": self.known(r.identity, "facts"), "health": health, "documents": documents,
            "refused": refused, "asks": asked_for(refused or ""), "listed": not self.known(r.identity, "removed"),
        }  # fmt: skip

    def _health_of_study(self, documents: list[str]) -> Json | None:
        judged = [self._documents[d] for d in documents if self._documents[d].facts.get("health")]
        newest = max(judged, key=lambda d: d.modified, default=None)
        return None if newest is None else newest.facts["health"]

    def document_json(self, d: Document, recording: str | None) -> dict[str, Any]:
        """One result."""
        facts = {k: v for k, v in d.facts.items() if k != "health"}
        files = self.files_of(d)
        return {
            "id": d.id, "name": d.name, "format": d.format, "size": d.size, "modified": utc(d.modified),
            "title": facts.get("title") or d.name, "source": facts.get("source"), "recording": recording,
            "command": facts.get("command"), "report": any(p.name == "report.html" for p in files),
            "files": [{"index": i, "name": _shown(p.name), "size": p.stat().st_size} for i, p in enumerate(files)],
        }  # fmt: skip

    def files_of(self, d: Document) -> list[Path]:
        """The result and what was left beside it, where the folder is that of one result."""
        folder = d.path.parent
        shared = any(o.path.parent == folder and o.id != d.id for o in self._documents.values())
        if shared or folder == self._settings.folder:
            return [d.path]
        return [
            p for p in sorted(folder.iterdir())
            if p.suffix.lower() in _BESIDE and not p.name.startswith(".") and p.is_file() and not p.is_symlink()
        ]  # fmt: skip


# -- pieces -----------------------------------------------------------------------------------------------


def _said(path: Path, size: int, most: int, kind: str) -> Json:
    """Title, source, command and health that a result states."""
    if size > most:
        return {}
    try:
        content = parse_plain(read_regular_text(path))
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(content, dict):
        return {}
    made = content.get("provenance")
    made = made if isinstance(made, dict) else {}
    source = made.get("source") or content.get("source")
    what = kind.removeprefix("allanite-").replace("-", " ").capitalize()
    title = f"{what} of {source}" if isinstance(source, str) and source else what
    findings, origin = content.get("findings"), "study" if kind == "allanite-study" else kind
    return {
        "title": _shown(title), "source": source if isinstance(source, str) else None,
        "command": made["command"] if isinstance(made.get("command"), str) else None,
        "health": health_of(findings, origin) if isinstance(findings, list) else None,
    }  # fmt: skip


def health_of(findings: list[Any], origin: str) -> Json:
    """The findings of a recording, counted."""
    kept = [f for f in findings if isinstance(f, dict) and f.get("severity") in _SEVERITIES]
    counts = {s: sum(1 for f in kept if f["severity"] == s and not f.get("accepted")) for s in _SEVERITIES}
    worst = next((s for s in ("fatal", "warning") if counts[s]), "good")
    short = [
        {k: f.get(k) for k in ("code", "severity", "message", "channel", "count", "accepted")} for f in kept
    ]
    return {"worst": worst, **counts, "findings": short[:100], "from": origin}


def _status(path: Path) -> str:
    """Of a run: the end that is noted last; "recording" while somebody writes to it."""
    from allanite.files.store.manifest import is_locked, read_manifest_on

    try:
        alive = is_locked(path)
        events, _ = read_manifest_on(path, max((path / "manifest.jsonl").stat().st_size - _END, 0))
    except OSError:
        return "unfinished"
    end = next((e for e in reversed(events) if e.get("kind") == "end"), None)
    return str(end.get("status")) if end else "recording" if alive else "unfinished"


def _folder_identity(path: Path) -> str:
    listing = sorted((p.name, p.stat().st_size, p.stat().st_mtime_ns) for p in path.iterdir() if p.is_file())
    return hashlib.sha256(f"{path} {listing}".encode(errors="surrogateescape")).hexdigest()[:32]


def _size(path: Path, stat: os.stat_result) -> int:
    return sum(p.stat().st_size for p in path.iterdir() if p.is_file()) if path.is_dir() else stat.st_size


def _modified(path: Path, stat: os.stat_result) -> float:
    if not path.is_dir():
        return stat.st_mtime
    return max((p.stat().st_mtime for p in path.iterdir() if p.is_file()), default=stat.st_mtime)


def _shown(name: str) -> str:
    """A name as text that every answer can hold."""
    return name.encode("utf-8", "replace").decode()


def utc(seconds: float) -> str:
    """An instant as text."""
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
