# SPDX-License-Identifier: BSD-3-Clause
"""Runs that allanite has not written: their checksums agree, and what they say does not hold together."""

from __future__ import annotations

import itertools
import json
import re
import zlib
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from numpy.typing import NDArray
from tests.hostile_shapes.runs import signed

from allanite.errors import AllaniteError, FormatError
from allanite.files.readers import read
from allanite.files.store import message, open_run, recover
from allanite.files.store.message import Opening
from allanite.files.store.segment import ReadPosition
from allanite.plain_files.arrow_numbers import arrow_of
from log_store_runs import HEADER, numbers_of, write_run


@pytest.mark.parametrize(
    "line",
    [
        '{"kind": ' + "[" * 50_000 + "}",
        {"kind": "remark", "utc_ns": "now", "monotonic_ns": 1},
        {"kind": "gap", "utc_ns": 1, "monotonic_ns": 1, "counter": "a", "samples": 3},
        {"kind": "gap", "utc_ns": 1, "monotonic_ns": 1, "counter": 1, "samples": 1 << 64},
        {"kind": "closed", "utc_ns": 1, "monotonic_ns": 1, "segment": "../x", "bytes": 1, "sha256": ""},
        {"kind": "run", "utc_ns": 1, "monotonic_ns": 1, "run": "a", "header": []},
        {"kind": [], "utc_ns": 1, "monotonic_ns": 1},
        {"utc_ns": 1, "monotonic_ns": 1},
    ],
    ids=["nested", "clock", "gap", "long gap", "segment", "header", "kind", "no kind"],
)
def test_a_line_that_is_signed_and_says_nonsense_is_a_damaged_line(tmp_path: Path, line: Any) -> None:
    folder = write_run(tmp_path / "run", range(0, 320, 32))
    with (folder / "manifest.jsonl").open("a", encoding="utf-8") as manifest:
        manifest.write(signed(line) + "\n")
    run = open_run(folder)
    assert run.damaged_lines == 1
    assert run.status == "success"
    assert numbers_of(folder) == list(range(320))
    found = recover(folder, tmp_path / "out")
    assert [loss.why for loss in found.losses] == ["1 damaged line(s) left out"]
    assert found.kept == 320


def test_lines_that_are_sound_are_handed_on_in_their_order(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 320, 32))
    texts = [("remark", "a"), ("remark", "b"), ("climate", "c"), ("remark", "d")]
    lines = [{"kind": k, "utc_ns": i, "monotonic_ns": i, "text": t} for i, (k, t) in enumerate(texts)]
    with (folder / "manifest.jsonl").open("a", encoding="utf-8") as manifest:
        manifest.write("".join(signed(line) + "\n" for line in lines))
    recover(folder, tmp_path / "out")
    noted = [e for e in open_run(tmp_path / "out").manifest if "text" in e]
    assert [(e["kind"], e["text"]) for e in noted] == texts
    assert [e["utc_ns"] for e in noted] == [0, 1, 2, 3]


def test_an_opening_with_columns_of_other_types_is_none() -> None:
    """Samples are taken out of the buffers as they lie there: texts or lists in their place could lead anywhere."""
    sound = Opening.of(HEADER, "run")
    assert Opening.read(sound.data).header == HEADER
    for kind in (pa.string(), pa.float32(), pa.list_(pa.float64())):
        other = sound.schema.set(3, pa.field("gyro_z", kind, nullable=False))
        with pytest.raises(FormatError, match="columns"):
            Opening.read(other.serialize().to_pybytes())


def signed_batch(content: bytes, opening: Opening) -> bytes:
    """A segment whose first batch has a checksum that agrees."""
    start = len(opening.data)
    facts = re.search(rb"bytes=(\d{10}) crc32=(.{8})", content[start:])
    if facts is None:
        return content
    stop, crc = start + int(facts[1]), start + facts.start(2)
    unsigned = content[:crc] + b"00000000" + content[crc + 8 :]
    return content[:crc] + b"%08x" % zlib.crc32(unsigned[start:stop], opening.crc) + content[crc + 8 :]


@pytest.mark.long
def test_a_batch_that_verifies_and_cannot_be_decoded_is_an_error_of_format(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 320, 32))
    place = folder / "000001.arrows"
    content = bytearray(place.read_bytes())
    opening = Opening.read(bytes(content))
    start = len(opening.data)
    refused = 0
    for at, flip in itertools.product(range(start + 8, start + 400), (0x81, 0x02)):
        copy = bytearray(content)
        copy[at] ^= flip
        place.write_bytes(signed_batch(bytes(copy), opening))
        try:
            for batch in open_run(folder).batches():
                assert batch.values.shape == (len(batch), 2)
            open_run(folder).tail(ReadPosition())
        except AllaniteError:
            refused += 1
    assert refused > 40


def test_a_batch_whose_buffers_are_too_short_is_refused_at_every_door(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Samples that are missing, and lengths of what says so (or of the samples) that no longer hold them."""

    def with_missing(values: NDArray[Any]) -> pa.Array:
        missing = (np.arange(len(values)) == 3) & (values.dtype.kind == "f")
        return arrow_of(values, missing)

    monkeypatch.setattr(message, "arrow_of", with_missing)
    folder = write_run(tmp_path / "run", range(0, 96, 32))
    monkeypatch.undo()
    place = folder / "000001.arrows"
    content = place.read_bytes()
    opening = Opening.read(content)
    start = len(opening.data)
    stop = start + int.from_bytes(content[start + 4 : start + 8], "little")

    def values() -> None:
        recording = read(folder)
        for name in recording.names:
            recording.values(name)

    refused: Counter[str] = Counter()
    for at in range(start + 8, stop, 8):
        place.write_bytes(signed_batch(content[:at] + (1).to_bytes(8, "little") + content[at + 8 :], opening))
        doors = {
            "values": values,
            "batches": lambda: list(open_run(folder).batches()),
            "tail": lambda: open_run(folder).tail(),
            "recover": lambda: recover(folder, None),
        }
        for name, door in doors.items():
            try:
                door()
            except AllaniteError:
                refused[name] += 1
    assert refused["values"] > 10


def test_a_follower_looks_once_at_many_empty_segments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from allanite.files.store import segment

    folder = write_run(tmp_path / "run", range(0, 64, 32))
    for k in range(2, 40):
        (folder / f"{k:06d}.arrows").touch()
    looks = []
    numbers = segment.segment_numbers
    monkeypatch.setattr(segment, "segment_numbers", lambda place: looks.append(place) or numbers(place))
    batches, position = segment.read_on(folder, ReadPosition())
    assert np.concatenate([b.counter for b in batches]).tolist() == list(range(64))
    batches, position = segment.read_on(folder, position)
    assert (batches, position.segment) == ([], 39)
    assert len(looks) == 2


def test_a_header_with_numbers_beyond_all_is_damaged(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", range(0, 64, 32))
    (folder / "000001.arrows").unlink()
    place = folder / "manifest.jsonl"
    events = [json.loads(line) for line in place.read_text(encoding="utf-8").splitlines()]
    for event in events:
        del event["crc32"]
    events[0]["header"]["rate"] = 10**30
    place.write_text("".join(signed(event) + "\n" for event in events), encoding="utf-8")
    with pytest.raises(FormatError, match="the header of a run is damaged"):
        open_run(folder)
