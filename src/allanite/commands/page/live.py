# SPDX-License-Identifier: BSD-3-Clause
"""Runs that grow, for everybody who looks: one child follows each, and every look begins with the last word of it.

The recorder knows nothing of this: what is read is what it has left on the disk.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from allanite.commands.page.children import Child
from allanite.commands.page.replies import Refused
from allanite.commands.page.settings import Limits

__all__ = ["Live", "Watcher"]

Json = Mapping[str, Any]


class Watcher:
    """Follows one run."""

    def __init__(self, run: Path, task: Json) -> None:
        self.run = run
        self.lookers = 0
        self.number = 0
        self.over = False
        self._events: dict[str, tuple[int, Json]] = {}  # by name: number and the last data
        self._lock = threading.Lock()
        self._child = Child()
        self._child.tell(task)
        threading.Thread(target=self._listen, daemon=True).start()

    def since(self, number: int) -> list[tuple[int, str, Json]]:
        """Events after a number: of each name the last one."""
        with self._lock:
            events = [(n, name, data) for name, (n, data) in self._events.items() if n > number]
        return sorted(events, key=lambda event: event[0])

    def end(self) -> None:
        """Stop looking."""
        self._child.end()

    def _listen(self) -> None:
        for word in self._child.words():
            if "event" in word:
                self._put(word["event"], word["data"])
            elif "ended" in word:
                if word["ended"].get("exit"):
                    self._put("failed", {"message": word["ended"].get("message", "")})
                break
        else:
            if not self.over:
                self._put(
                    "failed", {"message": f"the process that followed the run died {self._child.died()}"}
                )
        self.over = True
        self._child.end()

    def _put(self, name: str, data: Json) -> None:
        with self._lock:
            if name == "run":  # a look without news says so, and what is known stays
                _, before = self._events.get("run", (0, {}))
                data = {**data, **{k: before.get(k) for k in ("series", "curves") if data.get(k) is None}}
            self.number += 1
            self._events[name] = (self.number, data)


class Live:
    """The runs that somebody looks at."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._lock = threading.Lock()
        self._watchers: dict[Path, Watcher] = {}

    def look(self, run: Path) -> Watcher:
        """Begin to look at a run; `leave` ends it.

        Raises
        ------
        Refused
            Too many runs are looked at.
        """
        with self._lock:
            watcher = self._watchers.get(run)
            if watcher is None or watcher.over:
                going = [w for w in self._watchers.values() if not w.over]
                if len(going) >= self._limits.watchers:
                    raise Refused(429, f"{len(going)} runs are already being followed: close one of them")
                watcher = self._watchers[run] = Watcher(
                    run, {"task": "follow", "run": str(run), "every": self._limits.look}
                )
            watcher.lookers += 1
            return watcher

    def leave(self, watcher: Watcher) -> None:
        """Nobody follows a run at which nobody looks."""
        with self._lock:
            watcher.lookers -= 1
            if watcher.lookers > 0:
                return
            if self._watchers.get(watcher.run) is watcher:
                del self._watchers[watcher.run]
        watcher.over = True
        watcher.end()

    def close(self) -> None:
        """Stop looking at all."""
        with self._lock:
            watchers, self._watchers = list(self._watchers.values()), {}
        for watcher in watchers:
            watcher.over = True
            watcher.end()
