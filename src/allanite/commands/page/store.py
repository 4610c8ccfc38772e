# SPDX-License-Identifier: BSD-3-Clause
"""Prepared series on the disk: found by what they were made of, opened once, the oldest removed when it is full."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import threading
from collections import OrderedDict
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from allanite import __version__
from allanite.commands.page.catalogue import Recorded
from allanite.commands.page.pyramid import VERSION, SeriesPyramid
from allanite.commands.page.replies import Refused
from allanite.commands.page.settings import Settings
from allanite.errors import FormatError

__all__ = ["SeriesStore"]

_OPEN = 8  # pyramids that stay mapped


class SeriesStore:
    """The prepared series of all recordings."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._folder = settings.cache / "series"
        self._lock = threading.Lock()
        self._open: OrderedDict[str, SeriesPyramid] = OrderedDict()
        self._of: dict[str, Recorded] = {}

    def key(self, recording: Recorded, read: Mapping[str, Any]) -> str:
        """Of a recording as it is read: another file or another unit is another series."""
        facts = json.dumps([__version__, VERSION, recording.identity, read], sort_keys=True)
        key = hashlib.sha256(facts.encode(errors="surrogateescape")).hexdigest()[:32]
        self._of[key] = recording
        return key

    def folder(self, key: str) -> Path:
        """Where it lies, or will."""
        return self._folder / key

    def get(self, given: str) -> SeriesPyramid:
        """A series that is prepared.

        Raises
        ------
        Refused
            It is none, or not prepared.
        """
        if given not in self._of:
            raise Refused(404, "no series with this id: open its recording")
        with self._lock:
            series = self._open.get(given)
            if series is None:
                try:
                    series = SeriesPyramid(self.folder(given))
                except FormatError:
                    raise Refused(404, "this series is not prepared: open its recording") from None
                with suppress(OSError):
                    os.utime(self.folder(given))
                self._open[given] = series
                while len(self._open) > _OPEN:
                    self._open.popitem(last=False)
            self._open.move_to_end(given)
            return series

    def ready(self, key: str) -> bool:
        """Whether it need not be prepared."""
        return (self.folder(key) / "series.json").is_file()

    def meta(self, key: str) -> dict[str, Any]:
        """What the page must know of a series before it shows it."""
        from allanite.quantities.display_units import display_unit

        facts, of = self.get(key).facts, self._of[key]
        rate = float(facts["rate"])
        channels, gaps = [], {}
        for i, c in enumerate(facts["channels"]):
            unit, factor = display_unit(c["kind"], "sd", c["unit"])
            channels.append(
                {
                    "index": i, "name": c["name"], "kind": c["kind"], "unit": c["unit"], "shown_unit": unit,
                    "shown_factor": c["scale"] / factor, "missing": c["missing"], "low": c["low"], "high": c["high"],
                }
            )  # fmt: skip
            gaps[str(i)] = [[a / rate, b / rate] for a, b in c["gaps"]]
        known = ("rate", "samples", "duration", "start", "read", "questions")
        return {
            "id": key, "recording": of.id, "name": of.name, **{k: facts[k] for k in known}, "channels": channels,
            "gaps": gaps,
        }  # fmt: skip

    def facts(self, key: str) -> dict[str, Any]:
        """What the catalogue keeps of it."""
        meta = self.meta(key)
        return {
            **{k: meta[k] for k in ("rate", "samples", "duration", "start", "read")},
            "missing": max((c["missing"] for c in meta["channels"]), default=0),
            "channels": [{k: c[k] for k in ("name", "kind", "unit")} for c in meta["channels"]],
        }

    def make_room(self) -> None:
        """Remove what was not looked at for longest, until all fits; and what a killed child has left."""
        with suppress(OSError):
            self._folder.mkdir(parents=True, exist_ok=True)
        with self._lock:
            by_age = [(p.stat().st_mtime, _size(p), p) for p in self._folder.iterdir() if p.is_dir()]
            total = sum(size for _, size, _ in by_age)
            free = shutil.disk_usage(self._folder).free
            for _, size, path in sorted(by_age):
                if total <= self._settings.limits.cache and free > self._settings.limits.spare:
                    return
                if path.name in self._open:
                    continue
                shutil.rmtree(path, ignore_errors=True)
                total, free = total - size, free + size


def _size(folder: Path) -> int:
    return sum(p.stat().st_size for p in folder.iterdir())
