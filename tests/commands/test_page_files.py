# SPDX-License-Identifier: BSD-3-Clause
"""What lies in the folder of a page: recordings of all formats, runs, results; and files that are dropped (row W8)."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import json
import os
import resource
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.requests import Request

from allanite.commands import environment_effects
from allanite.commands.page import sniffing, uploads
from allanite.commands.page.replies import Refused
from allanite.commands.page.uploads import DROPPED, name_for, receive
from allanite.errors import AllaniteError
from allanite.files.readers import READERS, _reader_for
from page_client import Browser, application, small_log
from shell import Run

SAMPLES = Path(__file__).parents[1] / "samples"


@pytest.fixture
def browser(tmp_path: Path) -> Browser:
    (tmp_path / "data").mkdir()
    return Browser(application(tmp_path / "data", tmp_path / "cache", upload=5000, spare=0))


def catalogue(browser: Browser) -> dict[str, Any]:
    return dict(browser.get("/api/catalogue").json())


# -- what is found --------------------------------------------------------------------------------------------


def samples() -> list[Path]:
    found = []
    for folder in sorted(p for p in SAMPLES.iterdir() if p.is_dir() and p.name in READERS):
        found += [p for p in sorted(folder.iterdir()) if p.name != "expected.json"]
    return found


@pytest.mark.parametrize("path", samples(), ids=lambda p: f"{p.parent.name}/{p.name}")
def test_first_bytes_tell_what_the_readers_find(path: Path) -> None:
    head = b"" if path.is_dir() else path.read_bytes()[: sniffing.HEAD]
    found = sniffing.recording_format(path, head)
    if path.parent.name == "raw_binary":  # nothing in them says what they are
        assert found is None
        return
    try:
        reader = _reader_for(path).__name__.rpartition(".")[2]
    except AllaniteError:
        reader = None  # refused with a sentence, which a job may say as well
    assert reader is None or found == reader or {found, reader} == {"parquet", "run"}  # a run made compact


def test_results_sources_and_other_files_are_no_recordings(tmp_path: Path) -> None:
    for name, text in {
        "study.json": '{\n "format": "allanite-study", "version": 1}',
        "models.json": '{"gyro": {"terms": [], "family": ""}}',
        "notes.md": "1 2\n3 4\n",
        "imu.yaml": "rate: 1\nnoise: 2\n",
        "words.txt": "these are words\nand no numbers at all\n",
        "allan.csv": "# format: allanite-curve\n1,2\n3,4\n",
        "over.csv": "# format: allanite-over-floor 1\n1,2\n3,4\n",
        "gyro_x.csv": ",".join(environment_effects._CURVE) + "\n1,2,3,4,5,6,7\n2,2,3,4,5,6,7\n",
        "zeros.bin": "\x00" * 100,
        "steps.json": '{\n "steps": [\n  {"a": 1},\n  {"b": [\n 2\n]}\n]\n}',
    }.items():
        (tmp_path / name).write_text(text)
        assert sniffing.recording_format(tmp_path / name, text.encode()) is None, name
    assert (
        sniffing.document_format(tmp_path / "study.json", b'{"format": "allanite-study"}') == "allanite-study"
    )
    assert sniffing.document_format(tmp_path / "m.json", b'{"gyro": {"terms": []}}') == "models"
    assert sniffing.document_format(tmp_path / "m.json", b'{"a": 1}') is None
    assert sniffing.recording_format(tmp_path / "a.txt", b"1.5\n-2e-3\n") == "text"


def test_catalogue_lists_and_refreshes(browser: Browser) -> None:
    root = browser.app.settings.folder
    assert catalogue(browser)["recordings"] == []
    (root / "sub").mkdir()
    small_log(root / "sub")
    (root / ".hidden").mkdir()
    small_log(root / ".hidden")
    (root / "sub" / "loop").symlink_to(root)
    result = {
        "format": "allanite-study", "version": 1, "provenance": {"source": "gyro.csv", "command": "allanite x"},
        "findings": [{"code": "missing", "severity": "warning", "message": "<b>", "channel": None, "count": 3}],
    }  # fmt: skip
    (root / "study.json").write_text(json.dumps(result))
    found = catalogue(browser)
    (recording,), (document,) = found["recordings"], found["documents"]
    assert (recording["name"], recording["format"], recording["is_run"]) == ("sub/gyro.csv", "text", False)
    assert recording["size"] == (root / "sub" / "gyro.csv").stat().st_size
    assert document["title"] == "Study of gyro.csv" and document["command"] == "allanite x"
    assert document["recording"] == recording["id"] and recording["documents"] == [document["id"]]
    assert recording["health"]["worst"] == "warning" and recording["health"]["from"] == "study"
    assert browser.get(f"/api/documents/{document['id']}").json() == result
    again = catalogue(browser)
    assert again["recordings"][0]["id"] == recording["id"]
    (root / "study.json").unlink()
    assert catalogue(browser)["documents"] == []
    assert browser.get(f"/api/documents/{document['id']}").status_code == 404


def test_tables_of_results_are_no_recordings(browser: Browser) -> None:
    """Those of jobs, and those that commands left beside a result; a log of the same name elsewhere is one."""
    root = browser.app.settings.folder
    for place in ("allanite-results/gyro-spectrum", "out", "logs"):
        (root / place).mkdir(parents=True)
        (root / place / "spectrum.csv").write_text("channel,frequency\ngyro,0.1\ngyro,0.2\n")
    (root / "allanite-results" / "gyro-spectrum" / "turns.csv").write_text("start,stop\n1,2\n3,4\n")
    for place in ("allanite-results/gyro-spectrum", "out"):
        (root / place / "spectrum.json").write_text('{"format": "allanite-spectrum", "version": 1}')
    (root / "out" / "gyro.csv").write_text("1.5\n2.5\n")
    found = catalogue(browser)
    assert sorted(r["name"] for r in found["recordings"]) == ["logs/spectrum.csv", "out/gyro.csv"]
    assert len(found["documents"]) == 2


_LAYOUT = """rate: 50
frame:
  length: 4
  fields:
    - {name: gyro_z, at: 0, type: f32, unit: deg/s}
"""


def test_raw_binary_logs_are_listed_with_the_layout_beside_them(browser: Browser, run: Run) -> None:
    root = browser.app.settings.folder
    samples = np.random.default_rng(1).standard_normal(500).astype("<f4")
    (root / "a b.bin").write_bytes(samples.tobytes())
    (root / "other.dat").write_bytes(samples.tobytes())
    (root / "notes.bin.txt").write_text("words alone\n")
    assert catalogue(browser)["recordings"] == []
    (root / "a b.yaml").write_text("title: no layout\nframe: imu_link\n")
    assert catalogue(browser)["recordings"] == []
    (root / "a b.yaml").write_text(_LAYOUT)
    (found,) = catalogue(browser)["recordings"]
    assert (found["name"], found["format"]) == ("a b.bin", "raw_binary")
    (root / "layout.yaml").write_text(_LAYOUT.replace("50", "25"))
    assert set(browser.names()) == {"a b.bin", "other.dat"}
    asked = {"kind": "check", "recording": browser.names()["a b.bin"]}
    shown = browser.post("/api/jobs/preview", asked).json()
    words = shlex.split(shown["command"])
    assert words == ["allanite", "info", "a b.bin", "--layout=a b.yaml", "--json"]
    with contextlib.chdir(root):
        typed = json.loads(run(*words[1:]).out)
        space: dict[str, Any] = {}
        exec(shown["python"], space)
    assert json.loads(json.dumps(space["facts"])) == typed
    assert (typed["samples"], typed["rate"]) == (500, 50.0)
    both = {"kind": "compare", "recordings": list(browser.names().values())}
    refused = browser.post("/api/jobs/preview", both)
    assert refused.status_code == 400 and "one layout" in refused.json()["error"]["message"]
    with browser:
        opening = browser.post(f"/api/recordings/{asked['recording']}/open").json()["job"]
        assert "--layout=" in opening["command"] and browser.wait(opening)["state"] == "done"
        series = browser.post(f"/api/recordings/{asked['recording']}/open").json()["series"]
        assert (
            series["samples"] == 500
            and series["read"] == {}
            and series["channels"][0]["shown_unit"] == "deg/s"
        )
    # Another layout is another series; one that leads out of the folder is none.
    before = browser.app.catalogue.recording(asked["recording"]).identity
    (root / "a b.yaml").write_text(_LAYOUT.replace("50", "600"))
    assert set(browser.names()) == {"a b.bin", "other.dat"}
    assert browser.app.catalogue.recording(asked["recording"]).identity != before
    outside = root.parent / "outside.yaml"
    outside.write_text(_LAYOUT)
    (root / "a b.yaml").unlink()
    (root / "layout.yaml").unlink()
    (root / "a b.yaml").symlink_to(outside)
    assert catalogue(browser)["recordings"] == []


def test_runs_are_recordings(browser: Browser) -> None:
    import shutil

    shutil.copytree(SAMPLES / "run" / "finished", browser.app.settings.folder / "run1")
    (found,) = catalogue(browser)["recordings"]
    assert (found["format"], found["is_run"], found["status"]) == ("run", True, "success")


def test_damaged_results_say_so_and_harm_nothing(browser: Browser) -> None:
    root = browser.app.settings.folder
    (root / "broken.json").write_text('{"format": "allanite-study", ')
    (root / "deep.json").write_text('{"format": "allanite-plan", "x": ' + "[" * 100_000)
    (root / "list.json").write_text('{"format": "allanite-plan", "provenance": [], "findings": [3]}')
    found = catalogue(browser)["documents"]
    assert len(found) == 3
    for document in found:
        answer = browser.get(f"/api/documents/{document['id']}")
        assert answer.status_code == (200 if document["name"] == "list.json" else 400), document


def test_many_files_are_cut_and_said(tmp_path: Path) -> None:
    for i in range(6):
        (tmp_path / f"{i}.csv").write_text("1\n2\n")
    found = catalogue(Browser(application(tmp_path, tmp_path / ".cache", files=4)))
    assert found["truncated"] and len(found["recordings"]) == 4


# -- dropped files --------------------------------------------------------------------------------------------


def drop(browser: Browser, content: Any, **headers: str) -> Any:
    known = {**browser.proof, "Content-Type": "application/octet-stream", **headers}
    return browser.client.post("/api/upload", content=content, headers=known)


def left(browser: Browser) -> list[str]:
    folder = browser.app.settings.folder / DROPPED
    return sorted(p.name for p in folder.iterdir()) if folder.exists() else []


def test_dropped_file_becomes_a_recording(browser: Browser) -> None:
    log = b"t,gyro\n" + b"".join(b"%d,0.5\n" % i for i in range(200))
    answer = drop(browser, log, **{"X-File-Name": "..%2F..%2Fmy%20log%20%C3%A9.csv"})
    assert answer.status_code == 201
    (name,) = left(browser)
    assert name.startswith("my-log-") and name.endswith(".csv")
    assert answer.json()["recording"]["name"] == f"{DROPPED}/{name}"
    assert (browser.app.settings.folder / DROPPED / name).read_bytes() == log
    assert drop(browser, log, **{"X-File-Name": "my log.csv"}).status_code == 201
    assert len(left(browser)) == 2  # nothing is replaced


@pytest.mark.parametrize(
    ("content", "status"),
    [(b"x" * 5001, 413), (b"", 400), (b"no numbers in here\nat all\n", 400), (b"\x80\x04pickle" * 9, 400)],
)
def test_w8_what_is_no_log_or_too_large_leaves_nothing(browser: Browser, content: bytes, status: int) -> None:
    assert drop(browser, content, **{"X-File-Name": "a.csv"}).status_code == status
    assert left(browser) == []

    def pieces() -> Any:
        yield from (content[i : i + 999] for i in range(0, len(content), 999))

    assert drop(browser, pieces(), **{"X-File-Name": "a.csv"}).status_code == status  # no length is announced
    assert left(browser) == []


def test_w8_forms_of_many_parts_are_refused(browser: Browser) -> None:
    parts = [("file", (f"{i}.csv", b"1\n", "text/csv")) for i in range(1000)]
    answer = browser.client.post("/api/upload", files=parts, headers=browser.proof)
    assert answer.status_code == 400 and left(browser) == []


def fed(browser: Browser, messages: Sequence[Callable[[], Any]], headers: dict[str, str]) -> int:
    """Status of an upload whose pieces come as they are called for."""
    pieces = iter(messages)

    async def next_piece() -> Any:
        return await next(pieces)()

    scope = {
        "type": "http", "method": "POST", "path": "/api/upload", "query_string": b"",
        "headers": [(k.encode(), v.encode()) for k, v in headers.items()],
    }  # fmt: skip

    async def take() -> int:
        try:
            await receive(Request(scope, next_piece), browser.app.settings)
        except Refused as refused:
            return refused.status
        return 201

    return asyncio.run(take())


def piece(content: bytes, after: float = 0.0, last: bool = False) -> Callable[[], Any]:
    async def come() -> Any:
        await asyncio.sleep(after)
        return {"type": "http.request", "body": content, "more_body": not last}

    return come


def gone() -> Callable[[], Any]:
    async def come() -> Any:
        return {"type": "http.disconnect"}

    return come


def test_w8_slow_uploads_end(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    silent = Browser(application(tmp_path / "data", tmp_path, silence=0.05, spare=0), enter=False)
    assert fed(silent, [piece(b"1\n"), piece(b"2\n", after=5.0)], {}) == 408
    dripping = Browser(application(tmp_path / "data", tmp_path, grace=0.1, slowest=1e4, spare=0), enter=False)
    assert fed(dripping, [piece(b"1", after=0.02) for _ in range(100)], {}) == 408
    assert fed(dripping, [piece(b"1\n2\n"), gone()], {}) == 400
    assert fed(dripping, [piece(b"1\n2\n", last=True)], {"content-length": "9"}) == 400
    assert fed(dripping, [], {"content-length": "-1"}) == 400
    assert left(silent) == []


def test_w8_full_disk_is_said_and_nothing_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data").mkdir()
    crowded = Browser(application(tmp_path / "data", tmp_path, spare=1 << 60))
    assert drop(crowded, b"1\n2\n").status_code == 507

    async def refuse(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    browser = Browser(application(tmp_path / "data", tmp_path, spare=0))
    monkeypatch.setattr(uploads, "run_in_threadpool", refuse)
    assert drop(browser, b"1\n2\n").status_code == 507
    assert left(browser) == []


def test_w8_memory_stays_small(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    browser = Browser(application(tmp_path / "data", tmp_path, spare=0), enter=False)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    chunk = b"1.0,2.0,3.0\n" * 87_381  # one MiB
    assert fed(browser, [*[piece(chunk)] * 128, piece(b"", last=True)], {}) == 201
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 32_000  # KiB, of 131 000 that came
    (name,) = left(browser)
    assert (browser.app.settings.folder / DROPPED / name).stat().st_size == 128 * len(chunk)


@pytest.mark.parametrize(
    "given",
    [
        "",
        "..",
        "../../etc/passwd",
        "a\\..\\b.csv",
        ".bashrc",
        "%00",
        "%2e%2e%2fx.csv",
        "con.csv",
        "é" * 300,
        "-rf.csv",
        "a" * 900,
    ],
)
def test_names_of_dropped_files_are_made_here(given: str) -> None:
    import re

    name = name_for(given)
    assert re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,100}", name) and ".." not in name, name
    assert name != name_for(given)
