# SPDX-License-Identifier: BSD-3-Clause
"""Captures: recorders that are started from the page, and belong to nobody but the machine.

A recorder is `allanite record ...` in a session of its own. It goes on when the page is closed, and when the server
ends or is killed; a server that starts later finds it again by a note of its process and of when that began.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import field
from pathlib import Path
from typing import Any

from allanite.commands.option import Option
from allanite.commands.page.attached import KINDS, Attached, Named
from allanite.commands.page.bounds import own_folder, read_inside
from allanite.commands.page.catalogue import Catalogue, utc
from allanite.commands.page.options import checked, described, given_in
from allanite.commands.page.replies import Refused
from allanite.commands.page.settings import Settings
from allanite.commands.page.work import model_word, path_word
from allanite.lazy_dataclasses import dataclass

__all__ = ["INSTRUMENTS", "RUNS", "Captures", "described_instruments"]

RUNS = "allanite-runs"
"""Folder of runs, in the one that is served."""

_TAIL = 2000  # characters of what a recorder says
_DESCRIPTION = 1 << 18  # bytes of a description of frames; allanite reads no longer one


def _option(type_: Any, flag: str, help_: str, **more: Any) -> Option:
    return Option(type=type_, flag=flag, python=flag.strip("-").replace("-", "_"), help=help_, **more)


_EVERY = {
    "duration": _option("seconds", "--duration", "Length [s]; without it until it is stopped."),
    "name": _option("text", "--name", "Name of the sensor."),
    "scale_date": _option("text", "--scale-date", "Date of the scale factor: 2026-09-01."),
}

INSTRUMENTS: Mapping[str, tuple[str, Mapping[str, Option], tuple[str, ...]]] = {
    "simulated": (
        "Simulated sensor at rest",
        {
            "model": _option("model", "--model", "Noise of the sensor."),
            "rate": _option("number", "--rate", "Sample rate in Hz."),
            "speed": _option("number", "--speed", "Speed-up over real time.", default=1.0),
            "seed": _option(
                "integer", "--seed", "Random seed; the same seed gives the same samples.", default=0
            ),
            "unit": _option("by-channel", "--unit", "Unit of the samples."),
            **_EVERY,
        },
        ("model",),
    ),
    "3458a": (
        "3458A multimeter",
        {
            "resource": _option("attached", "--resource", "Address of the instrument."),
            "rate": _option("number", "--rate", "Readings per second."),
            "scale": _option("text", "--scale", "Scale factor of the sensor: 24.0(2) mV/(deg/s)."),
            "range": _option("number", "--range", "Measurement range in V.", default=10.0),
            "nplc": _option("number", "--nplc", "Aperture in power-line cycles."),
            "aperture": _option("seconds", "--aperture", "In place of nplc [s]."),
            "autozero": _option("flag", "--autozero", "A zero reading before each reading."),
            **_EVERY,
        },
        ("resource", "rate"),
    ),
    "serial": (
        "IMU on a serial port",
        {
            "port": _option("attached", "--port", "Address of the instrument."),
            "format": _option(
                "description", "--format", "File in the folder that describes its frames (YAML)."
            ),
            **_EVERY,
        },
        ("port", "format"),
    ),
}
"""By name: title, options, those that are needed."""


def described_instruments() -> dict[str, Any]:
    """For the page."""
    return {
        name: {"title": title, "options": described(options), "required": list(required)}
        for name, (title, options, required) in INSTRUMENTS.items()
    }


@dataclass(slots=True, eq=False)
class _Capture:
    id: str
    instrument: str
    command: str
    out: Path
    pid: int
    began: str  # of the process, as the system counts
    started: float
    log: Path
    process: subprocess.Popen[bytes] | None = field(default=None, repr=False)
    exit: int | None = None

    @property
    def alive(self) -> bool:
        if self.process is not None:
            self.exit = self.process.poll()
            return self.exit is None
        return bool(self.began) and _began(self.pid) == self.began


class Captures:
    """Recorders of this folder."""

    def __init__(self, settings: Settings, catalogue: Catalogue, attached: Attached) -> None:
        self._settings, self._catalogue, self._attached = settings, catalogue, attached
        self._lock = threading.Lock()
        self._notes = settings.cache / "recorders" / _key_of(settings.folder)
        self._runs: dict[str, Path] = {}
        self._captures: dict[str, _Capture] = self._found()

    def start(self, request: Mapping[str, Any]) -> Mapping[str, Any]:
        """Start a recorder.

        Raises
        ------
        Refused
            An unknown instrument or option, a read-only folder, too many recorders.
        """
        name = str(request.get("instrument"))
        if name not in INSTRUMENTS:
            raise Refused(400, f"no instrument {name[:60]!r}; there are: {', '.join(INSTRUMENTS)}")
        if not self._settings.writable:
            raise Refused(409, "the folder is read-only: serve another one to record into it")
        _, options, required = INSTRUMENTS[name]
        given = given_in(request, "options")
        missing = [option for option in required if given.get(option) in (None, "", {})]
        format_words = self._format_of(name, given)
        if format_words:
            missing = [option for option in missing if option != "format"]
        if missing:
            raise Refused(400, f"give {' and '.join(missing)}")
        words = [*checked(options, given, self._place).words, *format_words]
        own_folder(self._settings, RUNS)
        with self._lock:
            if sum(c.alive for c in self._captures.values()) >= self._settings.limits.captures:
                raise Refused(429, "recorders are already running: stop one")
            capture = self._begun(name, ["record", name, *words, f"--out={RUNS}"], given.get("format"))
            self._captures[capture.id] = capture
        return self.to_json(capture)

    def _begun(self, name: str, shown: list[str], described: object) -> _Capture:
        """Start a recorder, with a copy of the description that a request chose: it stays what was looked at."""
        self._notes.mkdir(parents=True, exist_ok=True)
        key, argv = secrets.token_hex(12), shown
        log = self._notes / f"{key}.log"
        if described:
            copy = self._copied(self._catalogue.description(described).path, self._notes / key)
            argv = [f"--format={copy}" if word.startswith("--format=") else word for word in shown]
        with log.open("wb") as output:
            process = subprocess.Popen(
                [sys.executable, "-m", "allanite", *argv],
                cwd=self._settings.folder,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                start_new_session=True,
                env={**os.environ, "PYTHONUNBUFFERED": "1", "NO_COLOR": "1"},
            )
        capture = _Capture(
            id=key, instrument=name, command=shlex.join(["allanite", *shown]), out=self._settings.folder / RUNS,
            pid=process.pid, began=_began(process.pid), started=time.time(), log=log, process=process,
        )  # fmt: skip
        note = {k: getattr(capture, k) for k in ("id", "instrument", "command", "pid", "began", "started")}
        (self._notes / f"{key}.json").write_text(json.dumps(note), encoding="utf-8")
        return capture

    def get(self, given: object) -> _Capture:
        """The recorder with this id."""
        capture = self._captures.get(given) if isinstance(given, str) else None
        if capture is None:
            raise Refused(404, "no capture with this id")
        return capture

    def stop(self, capture: _Capture) -> None:
        """Ask a recorder to close its run, as Ctrl-C does."""
        if capture.alive:
            with suppress(ProcessLookupError):
                os.kill(capture.pid, signal.SIGINT)

    def all(self) -> list[Mapping[str, Any]]:
        """The newest first."""
        newest_first = sorted(self._captures.values(), key=lambda c: -c.started)
        return [self.to_json(c) for c in newest_first]

    def to_json(self, capture: _Capture) -> dict[str, Any]:
        """One recorder."""
        run = self._run_of(capture)
        state = "ended" if not capture.alive else "starting" if run is None else "recording"
        return {
            "id": capture.id, "instrument": capture.instrument, "state": state, "exit": capture.exit,
            "command": capture.command, "started": utc(capture.started),
            "run": None if run is None else self._catalogue.id_of(run), "message": _tail(capture.log),
        }  # fmt: skip

    def _run_of(self, capture: _Capture) -> Path | None:
        """The run that this recorder writes: its manifest is held by its process."""
        known = self._runs.get(capture.id)
        if known is not None:
            return known
        held = _held_by(capture.pid) if capture.alive else set()
        for manifest in sorted(capture.out.glob("*/manifest.jsonl")):
            if str(manifest.resolve()) in held:
                self._runs[capture.id] = manifest.parent
                note = self._notes / f"{capture.id}.json"
                with suppress(OSError, ValueError):
                    note.write_text(
                        json.dumps({**json.loads(note.read_text()), "run": manifest.parent.name}),
                        encoding="utf-8",
                    )
                return manifest.parent
        return None

    def _found(self) -> dict[str, _Capture]:
        """Recorders that an earlier server started and that still run; notes of others are removed."""
        running: dict[str, _Capture] = {}
        for note in sorted(self._notes.glob("*.json")):
            try:
                data = json.loads(note.read_text(encoding="utf-8"))
                run = data.pop("run", None)
                capture = _Capture(**data, out=self._settings.folder / RUNS, log=note.with_suffix(".log"))
            except (OSError, ValueError, TypeError):
                continue
            if capture.alive:
                running[capture.id] = capture
                if run is not None:
                    self._runs[capture.id] = capture.out / run
            else:
                note.unlink(missing_ok=True)
                note.with_suffix(".log").unlink(missing_ok=True)
                shutil.rmtree(note.with_suffix(""), ignore_errors=True)
        return running

    def _place(self, option: Option, name: str, value: Any) -> str:
        """The word for a value that is the id of something, or a model."""
        if option.type == "attached":
            return self._instrument(name, value).name
        if option.type == "description":
            return path_word(self._catalogue.description(value).path, self._settings)
        return model_word(value, self._catalogue, self._settings)

    def _instrument(self, option: str, given: object) -> Named:
        return self._attached.get(next(kind for kind, needed in KINDS.items() if needed == option), given)

    def _format_of(self, name: str, given: Mapping[str, Any]) -> list[str]:
        """The word for the description that the administrator's file gives with a port, if it does."""
        if name != "serial" or not given.get("port"):
            return []
        port = self._instrument("port", given["port"])
        if port.format and given.get("format"):
            raise Refused(400, f"{port.title} has its own description: leave out format")
        return [f"--format={port.format}"] if port.format else []

    def _copied(self, description: Path, folder: Path) -> Path:
        content = read_inside(description, self._settings, _DESCRIPTION)
        folder.mkdir()
        copy = folder / description.name
        copy.write_bytes(content)
        return copy


def _key_of(folder: Path) -> str:
    """A name for the folder that is served, the same at each start."""
    return hashlib.sha256(os.fsencode(folder)).hexdigest()[:24]


def _began(pid: int) -> str:
    """When a process began, in ticks since the machine did; "" for none: numbers of processes are used again."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    fields = text.rpartition(")")[2].split()
    return "" if fields[0] in ("Z", "X") else fields[19]


def _held_by(pid: int) -> set[str]:
    """Files that a process has open."""
    files = set()
    with suppress(OSError):
        for link in Path(f"/proc/{pid}/fd").iterdir():
            with suppress(OSError):
                files.add(str(link.readlink()))
    return files


def _tail(log: Path) -> str:
    try:
        return log.read_text(encoding="utf-8", errors="replace")[-_TAIL:].strip()
    except OSError:
        return ""
