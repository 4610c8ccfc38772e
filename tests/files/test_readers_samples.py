# SPDX-License-Identifier: BSD-3-Clause
"""Every file in tests/samples/<reader>/ is read and compared with what expected.json says about it.

To add a sample: put the file there and an entry into expected.json. Keys of an entry: options of `read`, then
either error and match (a pattern), or channels, rate, samples, first (first values), start, missing (per
channel), dtype, text, source and timebase (some of the notes), guess (a part of one).
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite import errors
from allanite.files.readers import read
from allanite.recording.records import Recording
from hostile_files import PATCHED, inline

SAMPLES = Path(__file__).resolve().parents[1] / "samples"


def folder_of(case: Any) -> str:
    """The reader of a case."""
    return str(case.id).partition("/")[0]


CASES = [
    pytest.param(folder / name, expected, id=f"{folder.name}/{name}")
    for folder in sorted(p.parent for p in SAMPLES.glob("*/expected.json"))
    for name, expected in json.loads((folder / "expected.json").read_text(encoding="utf-8")).items()
]
#: The first case of each folder.
FIRST = {str(case.id) for i, case in enumerate(CASES) if i == 0 or folder_of(CASES[i - 1]) != folder_of(case)}


@pytest.fixture(autouse=True)
def parsed_here(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parsers run in this process; those of the first file of each folder in a child, as for a user."""
    case = getattr(request.node, "callspec", None)
    if case is None or case.id in FIRST:
        return
    for name in PATCHED:
        monkeypatch.setattr(f"allanite.files.readers.{name}.run", inline)


@pytest.mark.long
@pytest.mark.parametrize(("path", "expected"), CASES)
def test_sample(path: Path, expected: dict[str, Any]) -> None:
    options = expected.get("options", {})
    if path.suffix in (".bag", ".db3", ".mcap") or path.is_dir():
        pytest.importorskip("rosbags", reason="the extra allanite[ros] is not installed")
    for suffix, module in {
        ".ulg": "pyulog",
        ".tlog": "pymavlink",
        ".rds": "rdata",
        ".rda": "rdata",
        ".tdms": "nptdms",
        ".h5": "h5py",
        ".xlsx": "python_calamine",
        ".ods": "python_calamine",
    }.items():
        if path.suffix == suffix or (module == "h5py" and path.name == "version73.mat"):
            pytest.importorskip(module, reason=f"the extra of {module} is not installed")
    if "error" in expected:
        with pytest.raises(getattr(errors, expected["error"])) as error:
            read(path, **options)
        assert re.search(expected["match"], str(error.value)), str(error.value)
        return
    recording = read(path, **options)
    must_match(recording, expected)


def must_match(recording: Recording, expected: dict[str, Any]) -> None:
    channels = [{"name": c.name, "kind": c.kind.value, "unit": c.unit} for c in recording.channels]
    assert channels == expected["channels"]
    assert recording.rate == pytest.approx(expected["rate"], rel=expected.get("rate_tolerance", 1e-12))
    assert recording.n_samples == expected["samples"]
    if "first" in expected:
        first = [recording.raw(n, 0, 1)[0] + recording.origin(n) for n in recording.names]
        assert first == pytest.approx(expected["first"], rel=1e-15)
    if "start" in expected:
        assert recording.start == expected["start"]
    if "dtype" in expected:
        assert {str(c.dtype) for c in recording.columns} == {expected["dtype"]}
    missing = {n: int(np.isnan(recording.values(n)).sum()) for n in recording.names}
    assert missing == {n: expected.get("missing", {}).get(n, 0) for n in recording.names}
    for part in ("text", "source", "timebase"):
        facts = recording.notes.get(part, {})
        for key, value in expected.get(part, {}).items():
            assert facts[key] == value, f"notes[{part!r}][{key!r}]"
    guesses = recording.notes.get("text", recording.notes["source"])["guesses"]
    assert any(expected.get("guess", "") in g for g in guesses) or "guess" not in expected, guesses
    json.dumps(recording.notes)  # plain data


def test_every_reader_has_samples_and_every_sample_is_expected() -> None:
    from allanite.files.readers import READERS

    for name in READERS:
        folder = SAMPLES / name
        listed = set(json.loads((folder / "expected.json").read_text(encoding="utf-8")))
        assert {p.name for p in folder.iterdir()} - {"expected.json"} == listed, name


#: SHA-256 of runs written in version 1 of the format: every later version must read the same bits out of them.
GOLDEN_RUNS = {
    "finished": "1f56398c411c9be82871a42583931dbd9dc4fd56be956e0352423032157586f6",
    "compacted.parquet": "1f56398c411c9be82871a42583931dbd9dc4fd56be956e0352423032157586f6",
    "cut": "e916561bf834b38a6347c53abc97c5610ec44bf7a79977c8903add2b12ca7478",
}


@pytest.mark.parametrize("name", GOLDEN_RUNS)
def test_f12_runs_of_version_1_are_read_bit_for_bit(name: str) -> None:
    recording = read(SAMPLES / "run" / name)
    facts = [(c.name, c.kind.value, c.unit, c.scale.hex(), c.sampling) for c in recording.channels]
    found = hashlib.sha256(json.dumps([recording.rate.hex(), recording.start, facts]).encode())
    for channel in recording.names:
        found.update(recording.values(channel).astype("<f8").tobytes())
    assert found.hexdigest() == GOLDEN_RUNS[name]
