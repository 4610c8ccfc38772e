# SPDX-License-Identifier: BSD-3-Clause
"""What a request can reach: files in the served folder, attached instruments by id, and nothing else."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, get_args

import click
import httpx2 as httpx
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from starlette.routing import Route

from allanite.commands.cli import cli
from allanite.commands.option import Option, OptionType
from allanite.commands.page import attached, bounds, captures
from allanite.commands.page.attached import Attached, Named
from allanite.commands.page.captures import INSTRUMENTS
from allanite.commands.page.instruments_file import read_instruments
from allanite.commands.page.kinds import KINDS
from allanite.commands.page.options import READING
from allanite.commands.page.replies import Refused
from allanite.commands.page.work import work_of
from allanite.errors import InputError
from allanite.plain_files.regular_file import open_regular
from page_client import Browser, application, small_log
from sample_calibration import estimate
from shell import Run, program_context

ROOT = Path(__file__).parents[2]
WORDS = {"words": "N=0.3 deg/√h"}
HOSTILE = [
    "spy:///dev/tty?file=/tmp/x", "spy:///dev/tty?file=stolen", "socket://127.0.0.1:9", "rfc2217://127.0.0.1:9",
    "prologix://127.0.0.1:9/22", "prologix:///dev/tty/22", "TCPIP::127.0.0.1::9::SOCKET", "hwgrep://.*", "loop://",
    "http://127.0.0.1:9/x", "file:///etc/passwd", "/etc/passwd", "/dev/zero", "../neighbour/secret.csv", "../x", "..",
    "link.csv", "pipe.yaml", "gyro.csv", "--out=x", "-o x", "--unit-file=x", "-", "", " ", "a\0b", "a\nb", "a\rb",
    "a\x1b[2J", "$(id)", "`id`", "a;b", "~", "~/x", "*", "a=/etc/passwd", "a,b", "é" * 3000, "\ud800",
    "N=/etc/passwd", "N=0.3 deg/../../x", "N=1 deg/√h, ../../x", "N=1 deg/x.yaml",
    0, -1, 1e308, float("nan"), float("inf"), True, None, [], {}, ["/etc/passwd"], [["/etc/passwd", 1]],
    {"a": "/etc/passwd"},
    {"/etc/passwd": "deg/s"}, {"document": "/etc/passwd"}, {"words": "/etc/passwd"}, {"words": "N=1 deg/../../x"},
    {"words": "study.json"}, [[1, 2], ["../x", 3]], [[1e400, 1]],
]  # fmt: skip


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Browser:
    root = tmp_path_factory.mktemp("bounds")
    folder = world(root)
    found = Browser(application(folder, root / "cache", instruments=(METER, PORT)))
    found.app.attached._listed = lambda: ((), "")  # type: ignore[method-assign]  # what this machine has is no matter
    return found


METER = Named(kind="3458a", name="GPIB0::22::INSTR", title="meter")
PORT = Named(kind="serial", name="/dev/ttyUSB7", title="unit")


def world(root: Path) -> Path:
    """A folder that is served, with what an enemy may have put into it, and its neighbours."""
    folder, beside = root / "served", root / "neighbour"
    for place in (folder, beside, root / "home"):
        place.mkdir(parents=True)
    small_log(folder)
    small_log(folder, "other.csv", seed=2)
    small_log(beside, "secret.csv")
    (beside / "x1.yaml").write_text(X1)
    (folder / "x1.yaml").write_text(X1)
    (folder / "link.csv").symlink_to(beside / "secret.csv")
    (folder / "linked.yaml").symlink_to(beside / "x1.yaml")
    os.mkfifo(folder / "pipe.yaml")
    (folder / "calibration.json").write_text(json.dumps(estimate().to_json()))
    return folder


X1 = "model: X1\nrate: 100\nlines:\n  columns:\n    - {name: gyro_z, column: 0, unit: deg/s}\n"


def ids(browser: Browser) -> dict[str, str]:
    found = browser.app.catalogue.scan()
    return {f["name"]: f["id"] for what in ("recordings", "documents", "descriptions") for f in found[what]}


def request_of(kind: str, browser: Browser) -> dict[str, Any]:
    """One that is accepted."""
    known = ids(browser)
    required = {"latitude": -23.3, "model": WORDS, "consumer": "imu-tk"}
    return {
        "kind": kind, "recording": known["gyro.csv"], "document": known["calibration.json"], "model": WORDS,
        "recordings": [known["gyro.csv"], known["other.csv"]],
        "options": {name: required[name] for name in KINDS[kind].required},
    }  # fmt: skip


def words_of(request: Mapping[str, Any], browser: Browser) -> list[str] | None:
    """Of the command that a request asks for; None where it is refused."""
    try:
        work = work_of(request, browser.app.catalogue, browser.app.settings)
    except Refused:
        return None
    compile(work.python, "lines", "exec")
    assert shlex.split(work.command)[1:] == list(work.argv)
    return list(work.argv)


def command_of(words: list[str]) -> tuple[click.Command, list[str]]:
    """A command, and the words after its name."""
    command, rest = cli.commands[words[0]], words[1:]
    if isinstance(command, click.Group) and rest[0] in command.commands:
        return command.commands[rest[0]], rest[1:]
    return command, rest


def parsed(words: list[str]) -> dict[str, Any]:
    """Parameters of a command and what they are given, before anything is made of them."""
    command, rest = command_of(words)
    found, left, _ = command.make_parser(click.Context(command, parent=program_context())).parse_args(rest)
    assert not left, words
    return {k: v for k, v in found.items() if v is not None and v != ()}


def assert_bounded(words: list[str], before: list[str], option: Option | None, folder: Path) -> None:
    """A command names files of the folder alone, and has no parameter but that of the option besides those it had."""
    assert not any(set(word) & set("\0\n\r") for word in words), words
    command, _ = command_of(words)
    found, had = parsed(words), parsed(before)
    for param in command.params:
        names_files = isinstance(param, click.Argument) or isinstance(param.type, click.Path)
        if param.name in found and (names_files or param.name == "model"):
            given = found[param.name]
            for value in given if isinstance(given, (list, tuple)) else [given]:
                assert os.path.abspath(folder / value).startswith(f"{folder}/"), (param.name, value)  # noqa: PTH100
    new = set(found) - set(had)
    assert new <= {p.name for p in command.params if option is not None and option.flag in p.opts}, (
        new,
        words,
    )


TABLE = [("read", "characterize", name, READING[name]) for name in READING] + [
    ("options", kind, name, option) for kind, k in KINDS.items() for name, option in k.options.items()
]  # fmt: skip


@pytest.mark.parametrize(
    ("where", "kind", "name", "option"), TABLE, ids=lambda v: v if isinstance(v, str) else ""
)
def test_no_value_of_an_option_reaches_out(
    browser: Browser, where: str, kind: str, name: str, option: Option
) -> None:
    base = request_of(kind, browser)
    before = words_of(base, browser)
    assert before is not None
    for value in HOSTILE:
        words = words_of({**base, where: {**base.get(where, {}), name: value}}, browser)
        if words is not None:
            assert_bounded(words, before, option, browser.app.settings.folder)


VALUES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text() | st.sampled_from(HOSTILE),  # type: ignore[arg-type]
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=5,
)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(entry=st.sampled_from(TABLE), value=VALUES)
@example(entry=TABLE[0], value="--out=x")
def test_no_value_at_all_reaches_out(browser: Browser, entry: Any, value: Any) -> None:
    where, kind, name, option = entry
    base = request_of(kind, browser)
    before = words_of(base, browser)
    words = words_of({**base, where: {**base.get(where, {}), name: value}}, browser)
    if words is not None and before is not None:
        assert_bounded(words, before, option, browser.app.settings.folder)


@pytest.mark.parametrize("subject", ["recording", "document", "recordings", "model", "kind"])
def test_no_subject_reaches_out(browser: Browser, subject: str) -> None:
    for kind in KINDS:
        base = request_of(kind, browser)
        before = words_of(base, browser)
        for value in HOSTILE:
            words = words_of({**base, subject: value}, browser)
            if words is not None and before is not None:
                assert_bounded(words, before, None, browser.app.settings.folder)


# -- captures ------------------------------------------------------------------------------------------------------


def capture_of(instrument: str, browser: Browser) -> dict[str, Any]:
    known = {
        "model": WORDS, "rate": 10, "resource": METER.id, "port": PORT.id, "format": ids(browser)["x1.yaml"],
    }  # fmt: skip
    return {"instrument": instrument, "options": {n: known[n] for n in INSTRUMENTS[instrument][2]}}


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Commands of recorders, which are not started."""
    found: list[list[str]] = []

    def begun(self: Any, name: str, shown: list[str], described: object) -> Any:
        found.append(shown)
        raise Refused(409, "told")

    monkeypatch.setattr(captures.Captures, "_begun", begun)
    return found


@pytest.mark.parametrize(
    ("instrument", "name", "option"),
    [(i, n, o) for i, (_, options, _) in INSTRUMENTS.items() for n, o in options.items()],
    ids=lambda v: v if isinstance(v, str) else "",
)
def test_no_value_of_a_capture_reaches_out(
    browser: Browser, told: list[list[str]], instrument: str, name: str, option: Option
) -> None:
    base = capture_of(instrument, browser)
    assert browser.post("/api/captures", base).status_code == 409
    (before,) = told
    for value in HOSTILE:
        told.clear()
        with pytest.raises(Refused) as refused:
            browser.app.captures.start({**base, "options": {**base["options"], name: value}})
        assert bool(told) is (str(refused.value) == "told")
        for words in told:
            assert_bounded(words, before, option, browser.app.settings.folder)
            assert parsed(words).get("port") in (None, [PORT.name])
            assert parsed(words).get("resource") in (None, [METER.name])


def test_a_description_is_copied_as_it_was_looked_at(
    browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A link or a pipe that takes its place meanwhile is not read."""
    folder = browser.app.settings.folder
    assert "linked.yaml" not in ids(browser) and "pipe.yaml" not in ids(browser)
    started: list[list[str]] = []

    class Started:
        pid = 0

        def __init__(self, words: list[str], **_: Any) -> None:
            started.append(words)

        def poll(self) -> int:
            return 0

    monkeypatch.setattr(captures.subprocess, "Popen", Started)
    (folder / "swapped.yaml").write_text(X1)
    request = capture_of("serial", browser)
    request["options"]["format"] = ids(browser)["swapped.yaml"]
    answer = browser.post("/api/captures", request)
    assert answer.status_code == 201 and "--format=swapped.yaml" in answer.json()["capture"]["command"]
    (word,) = (w for w in started[0] if w.startswith("--format="))
    copy = Path(word.partition("=")[2])
    assert copy.read_text() == X1 and copy.is_relative_to(browser.app.settings.cache)
    (folder / "swapped.yaml").unlink()
    (folder / "swapped.yaml").symlink_to(folder.parent / "neighbour" / "x1.yaml")
    assert browser.post("/api/captures", request).status_code == 404
    (folder / "swapped.yaml").unlink()
    os.mkfifo(folder / "swapped.yaml")
    assert browser.post("/api/captures", request).status_code == 404
    (folder / "swapped.yaml").unlink()
    assert len(started) == 1


# -- links, pipes and devices in the folder ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["allanite-results", "allanite-runs", "allanite-dropped"])
@pytest.mark.parametrize("there", [True, False], ids=["link", "dangling link"])
def test_folders_that_the_page_fills_are_no_links(tmp_path: Path, name: str, there: bool) -> None:
    folder = world(tmp_path)
    target = tmp_path / "neighbour" / ("" if there else "none")
    (folder / name).symlink_to(target)
    browser = Browser(application(folder, tmp_path / "cache", spare=0))
    before = snapshot(tmp_path, folder)
    answers = {
        "allanite-results": lambda: browser.post("/api/jobs", request_of("check", browser)),
        "allanite-runs": lambda: browser.post("/api/captures", capture_of("simulated", browser)),
        "allanite-dropped": lambda: browser.client.post(
            "/api/upload", content=b"1\n2\n", headers={**browser.proof, "Content-Type": "application/octet-stream"}
        ),
    }  # fmt: skip
    answer = answers[name]()
    assert answer.status_code == 409 and name in answer.json()["error"]["message"], answer.text
    assert snapshot(tmp_path, folder) == before


def test_a_run_with_a_link_out_of_the_folder_is_none(tmp_path: Path) -> None:
    folder = world(tmp_path)
    (folder / "run").mkdir()
    (folder / "run" / "manifest.jsonl").write_text("{}\n")
    browser = Browser(application(folder, tmp_path / "cache"))
    key = ids(browser)["run"]
    (folder / "run" / "000001.arrows").symlink_to(tmp_path / "neighbour" / "secret.csv")
    assert browser.post("/api/jobs/preview", {"kind": "check", "recording": key}).status_code == 404
    assert "run" not in ids(browser)


def test_a_pipe_or_device_in_place_of_a_file_is_not_waited_for(tmp_path: Path) -> None:
    browser = Browser(application(world(tmp_path), tmp_path / "cache"))
    place = browser.app.settings.folder / "study.json"
    place.write_text('{"format": "allanite-study"}')
    key = ids(browser)["study.json"]
    place.unlink()
    os.mkfifo(place)
    assert browser.get(f"/api/documents/{key}").status_code == 404
    for name in ("pipe", "/dev/zero"):
        place.unlink()
        place.symlink_to(name)
        with pytest.raises(Refused, match="is gone"):
            bounds.read_inside(place, browser.app.settings, 100)
    assert "gyro.csv" in ids(browser)


def test_a_result_that_becomes_a_link_is_gone(tmp_path: Path) -> None:
    with Browser(application(world(tmp_path), tmp_path / "cache")) as browser:
        job = browser.wait(browser.start(**request_of("export", browser)))
        address = f"/api/jobs/{job['id']}/files/0"
        assert job["state"] == "done" and browser.get(address).status_code == 200
        own = browser.app.jobs.get(job["id"]).files[0]
        own.unlink()
        own.symlink_to(tmp_path / "neighbour" / "secret.csv")
        assert browser.get(address).status_code == 404


def test_a_file_that_cannot_be_read_hides_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from allanite.commands.page import catalogue

    def refused(path: Path) -> Any:
        if path.name == "gyro.csv":
            raise PermissionError(13, "Permission denied", str(path))
        return open_regular(path)

    monkeypatch.setattr(catalogue, "open_regular", refused)
    assert set(ids(Browser(application(world(tmp_path), tmp_path / "cache")))) >= {
        "other.csv",
        "calibration.json",
    }


# -- the program, as a whole ---------------------------------------------------------------------------------------


def snapshot(root: Path, served: Path) -> dict[str, tuple[int, int, str]]:
    """Everything that lies beside the served folder."""
    found = {}
    for place in sorted(root.rglob("*")):
        if place.is_relative_to(served):
            continue
        facts = place.lstat()
        content = place.read_bytes() if place.is_file() and not place.is_symlink() else b""
        found[str(place)] = (facts.st_mode, facts.st_mtime_ns, hashlib.sha256(content).hexdigest())
    return found


@pytest.fixture
def program(tmp_path: Path) -> Iterator[tuple[httpx.Client, dict[str, str], Path]]:
    """`allanite serve`: a client with its session, headers that prove it, and the tree around the served folder."""
    root = tmp_path / "tree"
    folder = world(root)
    listed = root / "instruments.yaml"
    listed.write_text("instruments:\n  - {kind: serial, title: a port, port: /dev/null}\n")
    environment = {
        **os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache"), "TMPDIR": str(tmp_path), "PYTHONUNBUFFERED": "1",
        "HOME": str(root / "home"), "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip
    server = subprocess.Popen(
        [sys.executable, "-m", "allanite", "serve", str(folder), "--no-browser", "--instruments", str(listed)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, cwd=root,
    )  # fmt: skip
    try:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        base = address.partition("/?")[0]
        with httpx.Client(base_url=base, timeout=60) as client:
            page = client.get(address)
            csrf = re.search(r'name="csrf-token" content="([^"]+)"', page.text)
            assert csrf is not None
            yield client, {"X-CSRF-Token": csrf[1], "Origin": base}, root
    finally:
        server.terminate()
        server.communicate(timeout=60)


def over(client: httpx.Client, what: str) -> list[dict[str, Any]]:
    """Jobs or captures once all have ended."""
    until = time.monotonic() + 120
    while time.monotonic() < until:
        found = client.get(f"/api/{what}").json()[what]
        if all(f["state"] in ("done", "failed", "cancelled", "ended") for f in found):
            return list(found)
        time.sleep(0.05)
    raise AssertionError(found)


def test_the_page_writes_into_the_served_folder_only(
    program: tuple[httpx.Client, dict[str, str], Path],
) -> None:
    """Every door is thrown at; then all that lies beside the folder is as it was."""
    client, proof, root = program
    master, slave = os.openpty()
    ports = [
        f"spy://{os.ttyname(slave)}?file={root}/stolen", f"spy://{os.ttyname(slave)}?file=../stolen", "loop://",
        os.ttyname(slave), f"{root}/neighbour/secret.csv",
    ]  # fmt: skip
    before = snapshot(root, root / "served")
    json_of = {**proof, "Content-Type": "application/json"}

    def post(path: str, body: Any) -> httpx.Response:
        return client.post(path, content=json.dumps(body), headers=json_of)

    listing = client.get("/api/catalogue").json()
    known = {
        f["name"]: f["id"] for what in ("recordings", "documents", "descriptions") for f in listing[what]
    }
    instruments = {i["title"]: i["id"] for i in client.get("/api/instruments").json()["instruments"]}
    for port in [*ports, instruments["a port"]]:
        for frames in (known["x1.yaml"], "x1.yaml", "../neighbour/x1.yaml", "linked.yaml", "pipe.yaml"):
            answer = post(
                "/api/captures", {"instrument": "serial", "options": {"port": port, "format": frames}}
            )
            accepted = (port, frames) == (instruments["a port"], known["x1.yaml"])
            assert answer.status_code == (201 if accepted else 404), answer.text
    for name in ("../../stolen", "--unit-file=x"):
        options_ = {"model": WORDS, "rate": 50, "speed": 50, "duration": 5, "name": name}
        assert post("/api/captures", {"instrument": "simulated", "options": options_}).status_code == 201
    for method in ("GET", "POST"):
        for path in (
            "/api/documents/..%2f..%2fx/files/0",
            "/static/..%2f..%2fserver.py",
            "/api/jobs/../../x",
        ):
            answer = client.request(method, path, headers=json_of)
            assert answer.status_code in (404, 405)
    for name in ("../../stolen.csv", "%2e%2e%2fstolen.csv", "/etc/stolen.csv", "..\\stolen.csv"):
        headers = {**proof, "Content-Type": "application/octet-stream", "X-File-Name": name}
        assert client.post("/api/upload", content=b"1.5\n2.5\n", headers=headers).status_code == 201
    for reading in ({"variable": "../x"}, {"topic": "/etc/passwd"}):
        answer = post("/api/jobs", {"kind": "check", "recording": known["gyro.csv"], "read": reading})
        assert answer.status_code == 202, answer.text
    exported = {"consumer": "imu-tk"}
    for extra in ({}, {"part": "../../stolen"}, {"rostopic": "/etc/x"}):
        request = {"kind": "export", "document": known["calibration.json"], "options": {**exported, **extra}}
        assert post("/api/jobs", request).status_code in (202, 400)
    recorded = over(client, "captures")
    assert len(recorded) == 3
    jobs = over(client, "jobs")
    assert sum(j["state"] == "done" for j in jobs) >= 1 and len(jobs) >= 5
    os.close(master)
    os.close(slave)
    assert snapshot(root, root / "served") == before
    made = {p.name for p in (root / "served").iterdir()}
    assert {"allanite-results", "allanite-runs", "allanite-dropped"} <= made
    runs = {p.name.split("_")[0] for p in (root / "served" / "allanite-runs").iterdir()}
    assert runs <= {"stolen", "unit-file-x"}


# -- instruments ---------------------------------------------------------------------------------------------------


def test_the_administrator_names_instruments(tmp_path: Path) -> None:
    (tmp_path / "x1.yaml").write_text(X1)
    place = tmp_path / "instruments.yaml"
    place.write_text(example_of_the_docs())
    first, second = read_instruments(place, [tmp_path / "served"])
    assert (first.kind, first.name, first.format) == ("serial", "/dev/ttyUSB0", str(tmp_path / "x1.yaml"))
    assert (second.kind, second.name) == ("3458a", "GPIB0::22::INSTR")
    assert first.id != second.id and re.fullmatch("[0-9a-f]{12}", first.id)
    found = Attached((first, second), 5.0)
    assert found.get("serial", first.id) == first
    with pytest.raises(Refused, match="id of an attached"):
        found.get("3458a", first.id)


def example_of_the_docs() -> str:
    page = (ROOT / "docs" / "howto" / "page.md").read_text(encoding="utf-8")
    (found,) = re.findall(r"```yaml\n(instruments:.*?)```", page, re.S)
    return str(found)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("- 1\n", "must begin with 'instruments:'"),
        ("instruments: 3\n", "instruments"),
        ("instruments:\n  - {kind: laser, title: a}\n", "line 2, instruments[0].kind"),
        ("instruments:\n  - {kind: serial, title: a}\n", "gives no port"),
        ("instruments:\n  - {kind: 3458a, title: a, port: /dev/x}\n", "gives no resource"),
        ("instruments:\n  - {kind: 3458a, title: a, resource: 'prologix:x'}\n", "write prologix://"),
        ("instruments:\n  - {kind: serial, title: a, port: /dev/x, format: none.yaml}\n", "no such file"),
        ("instruments:\n  - {kind: serial, title: a, port: /dev/x, baud: 1}\n", "not a known entry"),
        ('instruments:\n  - {kind: serial, title: "a\\nb", port: /dev/x}\n', "title"),
        (
            "instruments:\n  - {kind: serial, title: a, port: /dev/x}\n  - {kind: serial, title: a, port: /dev/y}\n",
            "given twice",
        ),
        ("instruments: [\n", "is not YAML"),
        ("instruments: !!python/object:os.system []\n", "programming language"),
    ],
)
def test_wrong_lists_of_instruments_are_told_what_is_wrong(tmp_path: Path, text: str, said: str) -> None:
    place = tmp_path / "instruments.yaml"
    place.write_text(text)
    with pytest.raises(InputError, match=re.escape(said)):
        read_instruments(place, [])


def test_a_list_that_the_page_could_write_is_refused(tmp_path: Path) -> None:
    (tmp_path / "served").mkdir()
    place = tmp_path / "served" / "instruments.yaml"
    place.write_text("instruments: []\n")
    outside = tmp_path / "link.yaml"
    outside.symlink_to(place)
    for source in (place, outside):
        with pytest.raises(InputError, match="the page writes to"):
            read_instruments(source, [tmp_path / "served"])
    with pytest.raises(InputError, match="no such file"):
        read_instruments(tmp_path / "none.yaml", [])


def test_the_program_refuses_a_wrong_list(tmp_path: Path, run: Run) -> None:
    (tmp_path / "served").mkdir()
    place = tmp_path / "instruments.yaml"
    place.write_text("instruments: 3\n")
    done = run("serve", tmp_path / "served", "--no-browser", "--instruments", place)
    assert done.code == 1 and "instruments.yaml has 1 fault" in done.err


def test_instruments_are_listed_without_asking_the_network() -> None:
    """pyvisa-py looks into the network when it is asked for all resources; it must not be asked."""
    program = """
import json, sys
asked = []
sys.addaudithook(lambda event, given: asked.append(event) if event in (
    "socket.connect", "socket.sendto", "socket.sendmsg", "socket.getaddrinfo", "socket.bind") else None)
from allanite.commands.page.attached import listed_here
print(json.dumps([listed_here(), asked]))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    found, asked = json.loads(done.stdout)
    assert asked == [] and isinstance(found["instruments"], list)


def test_visa_is_asked_for_gpib_and_usb_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    pyvisa = pytest.importorskip("pyvisa")
    asked: list[str] = []

    class Manager:
        class visalib:
            library_path = "/usr/lib/libvisa.so"

        def list_resources(self, query: str) -> tuple[str, ...]:
            asked.append(query)
            return ("GPIB0::22::INSTR",)

    monkeypatch.setattr(pyvisa, "ResourceManager", Manager)
    assert [found["name"] for found in attached._resources()] == ["GPIB0::22::INSTR"]
    assert asked == ["GPIB?*INSTR", "USB?*INSTR"]


def test_a_driver_that_hangs_or_dies_hides_no_named_instrument(monkeypatch: pytest.MonkeyPatch) -> None:
    for answer, said in ((None, "within 0.2 s"), ({"exit": 1, "message": "no driver"}, "no driver")):

        class Child:
            def __init__(self, seconds: float) -> None: ...

            def ask(self, task: Any, answer: Any = answer) -> Any:
                if answer is None:
                    raise Refused(503, "too long")
                return answer

            def close(self) -> None: ...

        monkeypatch.setattr(attached, "Quick", Child)
        found, note = Attached((PORT,), 0.2).look()
        assert found == (PORT,) and said in note


# -- the promise ---------------------------------------------------------------------------------------------------


def test_security_says_what_bounds_every_option_and_every_route(browser: Browser) -> None:
    text = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    _, found, section = text.partition("## What a request to the page can set")
    assert found, "SECURITY.md has no section on what a request to the page can set"
    named = set(re.findall(r"`([^`]+)`", section.partition("\n## ")[0]))
    routes = {r.path for r in browser.app.app.routes if isinstance(r, Route)}
    wanted = {*get_args(OptionType), *routes}
    assert wanted - named == set()
    stale = {n for n in named if n.startswith("/") and n not in routes}
    assert stale == set()
