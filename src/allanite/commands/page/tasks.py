# SPDX-License-Identifier: BSD-3-Clause
"""What a child process does for the page besides commands: prepare a series, draw a figure, follow a run.

Each takes plain data and returns plain data. They run outside the server, because they open files of others, and
because a picture of a long run must not keep a zoom waiting.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from allanite.plain_files.json_values import load_plain

__all__ = ["TASKS", "follow", "prepare"]

Json = Mapping[str, Any]
Advance = Callable[[float, str], None]

_RESULT = "a result of allanite"
#: Waits so many times as long as a look has cost, at least, where a second lies between two: some percent of one core.
_SPARING = 20.0
#: Blocks of the picture of a run that grows, at most.
_LIVE_BLOCKS = 1024


def prepare(task: Json, advance: Advance) -> Json:
    """Read a recording and leave its pyramid in "folder", which appears when it is whole."""
    from allanite.commands.page.pyramid import build
    from allanite.commands.recordings import read_part
    from allanite.recording.health.scale_questions import scale_questions

    target = Path(task["folder"])
    made = target.with_name(f"{target.name}.{time.time_ns():x}")
    made.mkdir(parents=True)
    try:
        advance(0.0, "reading")
        recording = read_part(task["log"], **task["read"])
        build(
            recording,
            made,
            facts={
                "read": dict(task.get("given", task["read"])),
                "questions": [q.to_json() for q in scale_questions(recording)],
            },
            progress=lambda f, s: advance(0.3 + 0.7 * f, s),
        )
        if not target.exists():
            made.rename(target)
    finally:
        shutil.rmtree(made, ignore_errors=True)
    return {}


def draw(task: Json, advance: Advance) -> Json:
    """The figure of a document; see `allanite.commands.page.documents.figure_of`."""
    from allanite.commands.page.documents import figure_of

    document = load_plain(task["document"], _RESULT)
    models = task.get("models")
    return figure_of(
        document,
        models=None if models is None else load_plain(models, "models of allanite"),
        without=task.get("without", ()),
        **task.get("options", {}),
    )


def parameters(task: Json, advance: Advance) -> Json:
    """The table of a study."""
    from allanite.commands.page.documents import parameters_of

    return parameters_of(load_plain(task["document"], _RESULT))


def said(task: Json, advance: Advance) -> Json:
    """A result in words, tables and figures."""
    from allanite.views.plain_page import plain_page

    document = load_plain(task["document"], _RESULT)
    return plain_page(document, only=task.get("only"))


def live_curve(task: Json, advance: Advance) -> Json:
    """The figure of the Allan curve of a run so far."""
    from allanite.commands.monitor import RunWatch
    from allanite.errors import DataQualityError
    from allanite.views.figures import sheet_of
    from allanite.views.figures.screen import spec

    watch = RunWatch(task["run"])
    watch.refuse_unknown(task.get("channel"))
    watch.look()
    curve = watch.curve()
    if curve is None:
        raise DataQualityError("no Allan curve yet: it needs at least three samples")
    chosen = curve if task.get("channel") is None else curve[task["channel"]]
    return spec(sheet_of(chosen))


def attached(task: Json, advance: Advance) -> Json:
    """The instruments that this machine lists."""
    from allanite.commands.page.attached import listed_here

    return listed_here()


def attempt(task: Json, advance: Advance) -> Json:
    """Read a file that looks like no recording: what its reader says of it is raised."""
    from allanite.commands.recordings import read_part

    read_part(task["log"])
    return {}


def fleet(task: Json, advance: Advance) -> Json:
    """A coefficient of all logs of a fleet, as an Arrow stream in a file."""
    from allanite.commands.page.fleet_table import fleet_stream

    return fleet_stream(task)


TASKS: Mapping[str, Callable[[Json, Advance], Json]] = {
    "series": prepare, "figure": draw, "parameters": parameters, "said": said, "live-curve": live_curve,
    "attached": attached, "attempt": attempt, "fleet": fleet,
}  # fmt: skip
"""By name, as the server asks for them."""


def follow(run: str, tell: Callable[[str, Json], None], *, every: float = 1.0) -> None:
    """Tell of a run while it grows, and of its end; each time all that a picture needs.

    Parameters
    ----------
    tell : callable
        Takes the name of an event, "run" or "ended", and its data.
    every : float [s]
        Between two looks; two of it between two curves.
    """
    from allanite.commands.monitor import RunWatch
    from allanite.commands.page.envelope import GrowingEnvelope
    from allanite.views.wording.run_end import RUN_STATES

    envelopes: dict[int, GrowingEnvelope] = {}

    def take(part: int, rate: float, channels: int, batches: Any) -> None:
        if part not in envelopes:
            envelopes.clear()
            envelopes[part] = GrowingEnvelope(channels, rate, most=_LIVE_BLOCKS)
        envelopes[part].take(batches)

    watch = RunWatch(run, also=take)
    curves_at, curves, samples = -10.0, None, -1
    while True:
        began = time.process_time()
        state = watch.look()
        going = state["status"] == "recording"
        state = {**state, "says": RUN_STATES[state["status"]][0]}
        if state["samples"] != samples or not going:
            samples = state["samples"]
            due = time.monotonic() - curves_at > 2 * every or not going
            if due:
                curves, curves_at = watch.curves(), time.monotonic()
            series = next((e.to_json() for e in envelopes.values()), None)
            tell("run", {"state": state, "series": series, "curves": curves if due else None})
        elif going:
            tell("run", {"state": state, "series": None, "curves": None})
        if not going:
            tell("ended", {"state": state})
            return
        time.sleep(every * max(1.0, _SPARING * (time.process_time() - began)))
