# SPDX-License-Identifier: BSD-3-Clause
"""A run watched: all that is said of it, look by look."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.commands.monitor.samples import PartSamples
from allanite.commands.monitor.story import Story, utc_text
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from allanite.files.store import Batch, Run
    from allanite.files.store.following import RunFollower
    from allanite.noise.allan import AllanCurve

__all__ = ["RunWatch"]


@dataclass(slots=True)
class RunWatch:
    """Follows a run; each `look` reads only what has come since the last one, in bounded memory.

    Parameters
    ----------
    folder : path
        Of a run; or of several, of which the one is followed that was written to last.
    also : callable, optional
        Given what `look` reads: number of the part, its rate, its number of channels, batches.

    Raises
    ------
    FormatError
        There is no run.
    """

    folder: str | os.PathLike[str]
    also: Callable[[int, float, int, list[Batch]], None] | None = None
    run: Run = field(init=False)
    _follower: RunFollower = field(init=False)
    _part: PartSamples = field(init=False)
    _story: Story = field(init=False)

    def __post_init__(self) -> None:
        from allanite.files.store import open_run
        from allanite.files.store.following import RunFollower

        place = _run_in(Path(self.folder))
        self.folder, self.run = place, open_run(place)
        self._follower = RunFollower(place, self.run.header)
        self._part = PartSamples(1, self.run.header)
        self._story = Story(place)

    def look(self, progress: Callable[[float, str], None] | None = None) -> Mapping[str, Any]:
        """Plain data of the moment.

        Parameters
        ----------
        progress : callable, optional
            Told the share read and what is being done: the first look at a long run takes its time.
        """
        self._story.look()  # before the samples: a run that has ended is read to its end
        while batches := self._follower.take():
            self._sum_up(batches)
            if progress is not None:
                progress(self._follower.share, "reading the run")
        story, part = self._story, self._part
        behind = max(story.end - part.last - 1, 0)  # noted as missing, and nothing came after it
        missing = part.missing + behind
        return {
            "format": "allanite-monitor",
            "version": 1,
            "folder": str(self.folder),
            "status": story.status,
            "reason": story.reason,
            "instrument": dict(part.header.instrument),
            "scale_date": part.header.scale_date,
            "channels": [c.to_json() for c in part.header.channels],
            "part": part.number,
            "rate": part.header.rate,
            "measured_rate": part.stamps.rate(),
            "samples": part.samples,
            "missing": missing,
            "missing_share": missing / max(part.samples + missing, 1),
            "gaps": part.gaps + bool(behind),
            "because": story.because(),
            "last_gap": story.last_gap,
            "outage": None if behind else self._outage(),
            "overloads": part.no_value,
            "doubtful": part.doubtful,
            "resyncs": part.resyncs,
            "remarks": story.remarks,
            "values": list(part.values),
            "age": part.age() if story.status == "recording" else None,
            "plan": self._plan(),
            "disk": self._disk(),
        }

    def curve(self) -> AllanCurve | None:
        """The Allan curve so far; None where there is none yet."""
        return self._part.curve()

    def curves(self) -> Mapping[str, Any]:
        """Plain data of the curve of each channel."""
        curve = self.curve()
        return {} if curve is None else {name: curve[name].to_json() for name in curve.names}

    def refuse_unknown(self, channel: str | None) -> None:
        """Raise if there is no curve of this channel.

        Raises
        ------
        InputError
            Names the channels that carry noise.
        """
        names = [c.name for c in self.run.header.channels if c.kind.noise_bearing]
        if channel is not None and channel not in names:
            raise InputError(
                f"no curve of a channel {channel!r} is followed; those that carry noise: {', '.join(names) or 'none'}"
            )

    # -- inside -----------------------------------------------------------------------------------------------

    def _sum_up(self, batches: list[Batch]) -> None:
        """Where the settings have changed, a new part begins."""
        if self._follower.part != self._part.number:
            self._part = PartSamples(self._follower.part, self._follower.header, before=self._part.last)
        self._part.take(batches)
        if self.also is not None:
            header = self._part.header
            self.also(self._part.number, header.rate, len(header.channels), batches)

    def _outage(self) -> Mapping[str, Any] | None:
        """Why nothing comes, and by the wall clock how much is missing so far: it is noted as a gap when it ends."""
        reason = self._story.trouble_after(self._part.last_ns)
        if reason is None:
            return None
        age = self._part.age() if self._story.status == "recording" else None
        return {
            "reason": reason,
            "seconds": age,
            "samples": None if age is None else round(age * self._part.header.rate),
        }

    def _plan(self) -> Mapping[str, Any] | None:
        """Of the planned duration, in the time of the instrument; None where no end was planned."""
        planned = self._story.planned
        if planned is None:
            return None
        done = max(self._part.last + 1, self._story.end)
        left = max(planned - done, 0) / self._part.header.rate
        going = self._story.status == "recording"
        return {
            "samples": planned,
            "seconds": planned / self._part.header.rate,
            "share": min(done / planned, 1.0),
            "left": left if going else None,
            "ends": utc_text(datetime.now(UTC) + timedelta(seconds=left)) if going else None,
        }

    def _disk(self) -> Mapping[str, Any]:
        from allanite.acquisition.capture import space_of

        header, plan = self._part.header, self._plan()
        left = None if plan is None else plan["left"]
        space = space_of(self.folder, header.rate, len(header.channels), left)
        return {
            "free": space.free, "seconds": space.seconds, "needed": space.needed, "enough": space.enough,
        }  # fmt: skip


def _run_in(folder: Path) -> Path:
    """The run in a folder of runs that was written to last; the folder itself where there is none."""
    from allanite.files.store.manifest import NAME

    if (folder / NAME).exists() or any(folder.glob("*.arrows")):
        return folder
    runs = [path.parent for path in folder.glob(f"*/{NAME}")]
    return max(runs, key=lambda run: (run / NAME).stat().st_mtime_ns, default=folder)
