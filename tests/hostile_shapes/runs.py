# SPDX-License-Identifier: BSD-3-Clause
"""Runs whose manifest is another one than allanite has written."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from tests import log_store_runs
from tests.hostile_shapes.shape import DEEP, DIGITS, HostileShape, Write

# -- runs --------------------------------------------------------------------------------------------------


def _run_with(change: Callable[[list[dict[str, Any]]], Any]) -> Write:
    """A finished run whose manifest is another one, signed as it should be."""

    def write(folder: Path) -> None:
        log_store_runs.write_run(folder, range(0, 320, 32))
        place = folder / "manifest.jsonl"
        events = [json.loads(line) for line in place.read_text(encoding="utf-8").splitlines()]
        for event in events:
            del event["crc32"]
        changed = change(events)
        lines = changed if isinstance(changed, list) else events
        place.write_text("".join(signed(line) + "\n" for line in lines), encoding="utf-8")

    return write


def signed(event: Any) -> str:
    """A line of a manifest with its checksum."""
    line = event if isinstance(event, str) else json.dumps(event, ensure_ascii=False)
    return f'{line[:-1]}, "crc32": "{zlib.crc32(line.encode()):08x}"}}'


def _set(kind: str, **facts: Any) -> Callable[[list[dict[str, Any]]], Any]:
    def change(events: list[dict[str, Any]]) -> None:
        for event in events:
            if event["kind"] == kind:
                event.update(facts)

    return change


def _drop(key: str) -> Callable[[list[dict[str, Any]]], Any]:
    return lambda events: [{k: v for k, v in event.items() if k != key} for event in events]


def _gap(**facts: Any) -> Callable[[list[dict[str, Any]]], Any]:
    return lambda events: [*events, {"kind": "gap", "utc_ns": 1, "monotonic_ns": 1, **facts}]


def _many_segments(folder: Path, count: int) -> None:
    log_store_runs.write_run(folder, range(0, 64, 32))
    for k in range(2, count):
        (folder / f"{k:06d}.arrows").touch()


def _tiny_batches(folder: Path) -> None:
    from allanite.files.store import LogStore

    with LogStore.create(folder, log_store_runs.HEADER) as store:
        for k in range(300):
            store.append(log_store_runs.batch_of(k, 1))


def changed_runs(wide: int) -> Iterator[HostileShape]:
    table: dict[str, tuple[Write, str]] = {
        "nested line": (_run_with(lambda e: [*e, '{"kind": ' + "[" * DEEP + "}"]), ""),
        "nested line that ends": (
            _run_with(lambda e: [*e, '{"kind": ' + "[" * 20_000 + "]" * 20_000 + "}"]),
            "",
        ),
        "line of 5000 digits": (_run_with(lambda e: [*e, '{"kind": "gap", "counter": ' + DIGITS + "}"]), ""),
        "lines without a kind": (_run_with(_drop("kind")), ""),
        "lines without a segment": (_run_with(_drop("segment")), ""),
        "lines without bytes": (_run_with(_drop("bytes")), ""),
        "lines without a header": (_run_with(_drop("header")), ""),
        "lines without a checksum": (_run_with(_drop("sha256")), ""),
        "kind that is a list": (_run_with(lambda e: [*e, {"kind": []}]), ""),
        "segment that is a list": (_run_with(_set("closed", segment=[1])), ""),
        "segment outside": (_run_with(_set("closed", segment="../../x")), ""),
        "bytes that are a text": (_run_with(_set("closed", bytes="a")), ""),
        "last that is a text": (_run_with(_set("closed", last="a")), ""),
        "first that is infinite": (_run_with(_set("closed", first=float("inf"))), ""),
        "header that is a list": (_run_with(_set("run", header=[])), ""),
        "header with a rate of 400 digits": (
            _run_with(_set("run", header={"channels": [], "rate": 10**400})),
            "",
        ),
        "status that is a list": (_run_with(_set("end", status=[], written="a")), ""),
        "gap that is a text": (_run_with(_gap(counter="a", samples=[])), ""),
        "gap that is infinite": (_run_with(_gap(counter=float("inf"), samples=1)), ""),
        "gap of 400 digits": (_run_with(_gap(counter=1, samples=10**400)), ""),
        "end of 400 digits": (_run_with(_set("end", written=10**400, end=10**400)), ""),
        "remarks of a text": (
            _run_with(lambda e: [*e, {"kind": "remark", "more": "a", "utc_ns": 1, "monotonic_ns": 1}]),
            "",
        ),
        "a hundred thousand lines": (
            _run_with(lambda e: [*e, *[{"kind": "remark", "text": "a"}] * 100_000]),
            "",
        ),
        "a hundred thousand gaps": (
            _run_with(lambda e: [*e, *[{"kind": "gap", "counter": 10, "samples": 3}] * 100_000]),
            "",
        ),
        "many empty segments": (lambda p: _many_segments(p, wide), ""),
        "batches of one sample": (_tiny_batches, ""),
    }
    for name, (write, says) in table.items():
        yield HostileShape(name=f"run, {name}", file="run", write=write, role="run", says=says)
