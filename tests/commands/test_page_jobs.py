# SPDX-License-Identifier: BSD-3-Clause
"""Work that the page asks for: the numbers of the command and of Python, the queue, crashes, cancelling (row W10)."""

from __future__ import annotations

import html
import json
import math
import os
import re
import shlex
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

import allanite as al
from allanite.commands.cli import cli
from allanite.commands.option import Option
from allanite.commands.page import jobs as page_jobs
from allanite.commands.page.documents import figure_of, parameters_of
from allanite.commands.page.kinds import KINDS
from allanite.commands.page.options import READING
from allanite.commands.page.work import Work, work_of
from allanite.errors import InputError
from allanite.files.recording_file import write_recording
from allanite.fitting import selection  # noqa: F401 - imported before the clocks run
from allanite.recording.records import Recording
from allanite.views import report as al_report
from allanite.views.plain_page import plain_page
from page_client import Browser, application, noise, small_log
from pages import text_of
from shell import Run, program_context

STATIC = Path(al.__file__).parent / "commands" / "page" / "static"
DWELL, RATE, LATITUDE = 20.0, 10.0, -23.31


def turned_log(folder: Path) -> Path:
    """A gyro that was turned every 20 s, with turns that do not show."""
    n = int(12 * DWELL * RATE)
    side = np.where((np.arange(n) // int(DWELL * RATE)) % 2 == 0, 1.0, -1.0)
    x = 3e-7 * np.random.default_rng(4).standard_normal(n) + 6.7e-5 * side + 1e-5
    return write_recording(
        Recording.from_rate(x, rate=RATE, unit="rad/s", names=["gyro"]), folder / "take.parquet"
    )


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    root = tmp_path_factory.mktemp("jobs")
    data = root / "data"
    data.mkdir()
    small_log(data, "gyro.csv")
    small_log(data, "other.csv", seed=2)
    turned_log(data)
    with Browser(application(data, root / "cache", workers=1)) as browser:
        yield browser


@pytest.fixture(scope="module")
def study(browser: Browser) -> dict[str, Any]:
    """A job that has characterised a recording, with lags left out by hand."""
    job = browser.start(
        kind="characterize", recording=browser.recording("gyro.csv"), options={"exclude": [[20, 40]]}
    )
    done = browser.wait(job)
    assert done["state"] == "done", done["message"]
    return done


def numbers(document: dict[str, Any]) -> dict[str, Any]:
    """A document without when and how it was made."""
    return {k: v for k, v in document.items() if k != "provenance"}


def repeated(
    browser: Browser,
    command: str,
    python: str,
    run: Run,
    monkeypatch: pytest.MonkeyPatch,
    names: tuple[str, ...],
) -> list[dict[str, Any]]:
    """Documents of the command and of the lines of Python that the page shows, each in a folder of its own."""
    root = browser.app.settings.folder
    monkeypatch.chdir(root)
    words = shlex.split(command)
    out = next((w for w in words if w.startswith(("--out=", "--output="))), "")
    place = out.partition("=")[2]
    found = []
    for n, how in enumerate(("typed", "lines")):
        mine = place.replace("allanite-results/", f"{how}/{n}-")
        (root / mine).parent.mkdir(parents=True, exist_ok=True)
        if how == "typed":
            done = run(*[w.replace(place, mine) if w == out else w for w in words[1:]])
            assert done.code in (0, 3), done.err
        else:
            exec(python.replace(repr(place), repr(mine)), {"__name__": "lines"})
        target = root / mine
        file = (
            target if target.is_file() else next(target / name for name in names if (target / name).exists())
        )
        found.append(json.loads(file.read_text()) if file.suffix == ".json" else file.read_text())
    return found


# -- the same numbers ------------------------------------------------------------------------------------------


@pytest.mark.long
def test_study_is_the_same_by_page_command_and_python(
    browser: Browser, study: dict[str, Any], run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = browser.get(f"/api/jobs/{study['id']}/document").json()
    assert study["command"] == page["provenance"]["command"]
    typed, lines = repeated(browser, study["command"], study["python"], run, monkeypatch, ("study.json",))
    assert numbers(page) == numbers(typed) == numbers(lines)
    out = study["command"].partition("--out=allanite-results/")[2].split()[0]
    report = browser.app.settings.folder / f"typed/0-{out}" / "report.html"
    said_as_by(text_of(report.read_text(encoding="utf-8")), page)
    some = plain_page(page, only=["verdict", "longer"])["sections"]
    assert isinstance(some, list) and [section["id"] for section in some] == ["verdict", "longer"]
    assert {f["name"] for f in study["files"]} == {"report.html", "study.json", "allan.csv", "imu.yaml"}
    curve = page["channels"][0]["curve"]
    left_out = [
        t for t, why in zip(curve["tau"], curve["excluded"], strict=True) if why == "left out by hand"
    ]
    assert left_out and all(20 <= t <= 40 for t in left_out)
    with pytest.raises(InputError, match="not a span of averaging times"):
        al.characterize(al.read(browser.app.settings.folder / "gyro.csv"), exclude=[(5.0, 2.0)])


@pytest.mark.long
def test_study_by_likelihood_is_the_same_by_page_command_and_python(
    browser: Browser, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = browser.start(
        kind="characterize", recording=browser.recording("gyro.csv"), options={"method": "likelihood"}
    )
    done = browser.wait(job)
    assert done["state"] == "done" and "--method=likelihood" in done["command"], done["message"]
    page = browser.get(f"/api/jobs/{done['id']}/document").json()
    typed, lines = repeated(browser, done["command"], done["python"], run, monkeypatch, ("study.json",))
    assert numbers(page) == numbers(typed) == numbers(lines)
    assert page["channels"][0]["models"][0]["goodness"]["method"] == "likelihood"


_WORDS = {"words": "N=0.001 deg/√h"}
_NOISE = {"words": "N=0.1 deg/√h"}
_REQUESTS: dict[str, dict[str, Any]] = {
    "fit": {"options": {"method": "likelihood", "terms": "NK", "lines": "1.5,3.3"}},
    "spectrum": {"read": {"start": 10, "stop": 110}, "options": {"method": "welch", "segment": 20, "overlap": 0.25}},
    "variation": {"read": {"stop": 60}, "options": {"model": _NOISE, "windows": 8}},
    "select": {"read": {"stop": 30}},
    "filter": {"read": {"stop": 60}, "options": {"model": _NOISE, "smooth": True}},
    "compare": {
        "recordings": ["gyro.csv", "other.csv"], "read": {"stop": 20}, "options": {"names": ["a", "b"]},
    },
    "earth-rate": {
        "recording": "take.parquet",
        "options": {
            "latitude": LATITUDE, "first": "north", "model": _WORDS, "dead_time": 1, "tilt": 0.1,
            "scale_uncertainty": 1e-3, "confidence": 0.9,
            "turns": [[k * DWELL - 0.4, k * DWELL + 0.4] for k in range(1, 12)],
        },
    },
    "north": {
        "recording": "take.parquet",
        "options": {
            "latitude": LATITUDE, "model": _WORDS, "heading_uncertainty": 1, "null": True,
            "headings": [[k * DWELL, (k + 1) * DWELL, 90 + 180 * (k % 2)] for k in range(12)],
        },
    },
    "plan": {
        "model": _WORDS, "options": {"latitude": LATITUDE, "goal": 0.02, "dwells": [10, 30], "durations": [600, 7200]},
    },
}  # fmt: skip


def said_as_by(report: str, document: dict[str, Any]) -> None:
    """The page says what the report says."""
    said = json.loads(json.dumps(plain_page(document)))
    blocks = [block for section in said["sections"] for block in section["blocks"]]
    kinds = {block["kind"] for block in blocks}
    assert said["title"] in report and {"table", "figure"} <= kinds <= set(BLOCKS)
    for section in said["sections"]:
        assert section["title"] in report
    for block in blocks:
        if block["kind"] == "table":
            assert all(html.unescape(cells[0]["text"]) in report for cells, _ in block["rows"])
        if block["kind"] == "figure":
            assert block["spec"]["panels"] and block["caption"][:40] in report


#: Those that the page can draw, as its script names them.
BLOCKS = re.findall(
    r"^  (\w+)(?::|,)",
    re.search(r"const MADE = \{\n(.*?)\n\};", (STATIC / "blocks.js").read_text(), re.S)[1],
    re.M,
)


@pytest.mark.long
@pytest.mark.parametrize("kind", list(_REQUESTS))
def test_other_kinds_are_the_same_by_command_and_python(
    browser: Browser, kind: str, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    request = {"kind": kind, "recording": "gyro.csv", **_REQUESTS[kind]}
    request["recording"] = browser.recording(request["recording"])
    if "recordings" in request:
        request["recordings"] = [browser.recording(name) for name in request["recordings"]]
    shown = browser.post("/api/jobs/preview", request).json()
    lists = work_of(request, browser.app.catalogue, browser.app.settings).lists or {}
    assert set(lists) == {"earth-rate": {"turns.csv"}, "north": {"headings.csv"}}.get(kind, set())
    place = browser.app.settings.folder / shlex.split(shown["command"])[-1].partition("=")[2]
    for name, text in lists.items():  # as it is written when the work begins
        place.mkdir(parents=True, exist_ok=True)
        (place / name).write_text(text)
    found = repeated(browser, shown["command"], shown["python"], run, monkeypatch, KINDS[kind].results)
    assert numbers(found[0]) == numbers(found[1])
    if kind != "fit":
        (report,) = browser.app.settings.folder.glob(f"typed/0-{place.name}/report.html")
        said_as_by(text_of(report.read_text(encoding="utf-8")), found[0])
    if kind == "earth-rate":
        assert len(found[0]["dwells"]) == 12 and found[0]["confidence"] == 0.9


def test_export_and_report_are_those_of_the_command(
    browser: Browser, study: dict[str, Any], run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = browser.wait(
        browser.start(
            kind="export", document=study["document"], options={"consumer": "kalibr", "axes": "worst"}
        )
    )
    assert done["state"] == "done", done["message"]
    file = browser.get(f"/api/jobs/{done['id']}/files/0")
    assert file.headers["content-disposition"].startswith('attachment; filename="imu.yaml"')
    typed, lines = repeated(browser, done["command"], done["python"], run, monkeypatch, ("imu.yaml",))
    assert file.text == typed == lines and "gyroscope_noise_density" in typed
    report = browser.get(f"/api/documents/{study['document']}/report")
    assert report.status_code == 200 and report.headers["content-disposition"].startswith("attachment")
    assert "sandbox" in report.headers["content-security-policy"]
    assert b"<title>" in report.content[:2000] or b"<!doctype html>" in report.content[:200].lower()


def test_planner_answers_while_a_slider_moves(browser: Browser, study: dict[str, Any], run: Run) -> None:
    request = {"model": {"document": study["document"]}, "options": {"latitude": LATITUDE, "dead_time": 3}}
    answer = browser.post("/api/plan", request)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert found["figure"]["panels"] and found["document"]["format"] == "allanite-plan"
    os.chdir(browser.app.settings.folder)
    typed = run(*shlex.split(found["command"])[1:], "--json")
    assert numbers(json.loads(typed.out)) == numbers(found["document"])
    space: dict[str, Any] = {}
    exec(found["python"], space)
    assert numbers(space["document"]) == numbers(found["document"])
    refused = browser.post("/api/plan", {**request, "options": {"latitude": 91}})
    assert refused.status_code == 400 and "pole" in refused.json()["error"]["message"]


# -- options ---------------------------------------------------------------------------------------------------


def _example(option: Option, name: str) -> Any:
    numbers_ = ("number", "share", "integer", "seconds", "degrees", "latitude", "deg/s", "deg/h", "deg/h/g")
    if option.type in numbers_:
        return 1
    special = {
        "names": ["a", "b"], "texts": ["drop_repeats"], "by-channel": {"a": "deg/s"}, "flag": True, "model": _WORDS,
        "seconds-list": [1, 2], "spans": [[1, 2]], "turns": [[1, 2]], "headings": [[1, 2, 3]],
    }  # fmt: skip
    if option.choices:
        return option.choices[0]
    return ["missing"] if name == "accept" else "a" if option.type == "text" else special.get(option.type)


@pytest.mark.parametrize("kind", list(KINDS))
def test_every_option_of_the_page_is_one_of_the_command(
    browser: Browser, study: dict[str, Any], kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command takes the words; and each option is told what it takes, alone."""
    monkeypatch.chdir(browser.app.settings.folder)
    k = KINDS[kind]
    options = {n: _example(o, n) for n, o in k.options.items()}
    for name, option in k.options.items():
        if option.type == "document":
            options[name] = study["document"]
        if option.type == "recording":
            options[name] = browser.recording("other.csv")
    if kind == "export":
        options["consumer"] = "kalibr"
    if kind == "plan":
        options["goal"] = 0.1
    options.pop("rotation", None)
    request = {
        "kind": kind, "recording": browser.recording("gyro.csv"), "document": study["document"], "model": _WORDS,
        "recordings": [browser.recording(n) for n in ("gyro.csv", "other.csv")], "options": options,
        **({"read": {n: _example(o, n) for n, o in READING.items()}} if k.reads else {}),
    }  # fmt: skip
    answer = browser.post("/api/jobs/preview", request)
    assert answer.status_code == 200, answer.text
    shown = answer.json()
    compile(shown["python"], "lines", "exec")
    words = shlex.split(shown["command"])
    command = cli.commands[words[1]]
    for name in ("turns.csv", "headings.csv"):  # what the job would write first
        words = [
            f"{w.partition('=')[0]}={browser.app.settings.folder / 'gyro.csv'}" if w.endswith(name) else w
            for w in words
        ]
    context = command.make_context(words[1], words[2:], parent=program_context())
    given = {
        p for p in context.params if context.get_parameter_source(p) is click.core.ParameterSource.COMMANDLINE
    }
    wanted = len([n for n in options if n != "consumer"]) + (len(READING) if k.reads else 0)
    assert len(given) >= wanted, (given, options)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"kind": "rm"}, "no kind of work"), ({"options": {"--out": "/etc"}}, "no option"), ({"options": []}, "object"),
        ({"options": {"exclude": [[5, 2]]}}, "start before stop"), ({"options": {"exclude": [["a", 2]]}}, "number"),
        ({"options": {"statistic": "x"}}, "must be one of"), ({"read": {"rate": "1; rm"}}, "must be a number"),
        ({"read": {"rate": True}}, "must be a number"), ({"read": {"rate": float("inf")}}, "must be a number"),
        ({"read": {"unit": "a\nb"}}, "line of text"), ({"read": {"unit": {"a": "x,y=z"}}}, "comma"),
        ({"read": {"channels": ["a,b"]}}, "comma"), ({"read": {"layout": "x"}}, "no option"),
        ({"options": {"floor": "../x"}}, "no recording"), ({"recording": None}, "no recording"),
        ({"kind": "spectrum", "options": {"model": {"words": "/etc/passwd"}}}, "model must be"),
        ({"kind": "spectrum", "options": {"model": {"words": "N=1/../../etc/passwd"}}}, "model must be"),
        ({"kind": "spectrum", "options": {"model": "study.json"}}, "model must be"),
        ({"kind": "earth-rate"}, "give latitude"), ({"kind": "export"}, "no document"),
        ({"kind": "compare", "recordings": ["x"]}, "2 to 64"), ({"kind": ["check"]}, "no kind of work"),
    ],
)  # fmt: skip
def test_wrong_requests_are_told_what_is_wrong(browser: Browser, change: dict[str, Any], said: str) -> None:
    request = {"kind": "characterize", "recording": browser.recording("gyro.csv"), **change}
    text = json.dumps(request)
    answer = browser.client.post(
        "/api/jobs/preview", content=text, headers={**browser.proof, "Content-Type": "application/json"}
    )
    assert answer.status_code in (400, 404) and said in answer.json()["error"]["message"], answer.text


def test_words_of_a_user_never_become_options(browser: Browser) -> None:
    request = {
        "kind": "characterize", "recording": browser.recording("gyro.csv"),
        "read": {"unit": "--force", "topic": "-o /etc/x", "variable": "$(id); `id`"},
    }  # fmt: skip
    words = shlex.split(browser.post("/api/jobs/preview", request).json()["command"])
    assert words[3:6] == ["--unit=--force", "--topic=-o /etc/x", "--variable=$(id); `id`"]
    for bad in (b"[]", b"{", b"\xff", b'{"a":' * 100_000):
        headers = {**browser.proof, "Content-Type": "application/json"}
        assert browser.client.post("/api/jobs", content=bad, headers=headers).status_code == 400
    assert browser.client.post("/api/jobs", content=b" " * (2 << 20), headers=headers).status_code == 413


def test_report_of_a_week_of_three_axes_is_small(tmp_path: Path) -> None:
    """With its interaction; and every figure is there without scripts, too."""
    n = 7 * 1728
    x = 1e-4 * np.random.default_rng(2).standard_normal((n, 3))
    x[:, 0] += np.cumsum(x[:, 1]) / 100
    week = Recording.from_rate(x, rate=0.02, unit="rad/s", names=["gyro_x", "gyro_y", "gyro_z"])
    assert week.duration == pytest.approx(7 * 86400, rel=1e-3)
    page = al.render(al.characterize(week), tmp_path / "report.html").read_text(encoding="utf-8")
    assert len(page.encode()) <= 6e6
    figures = page.count('class="live"')
    assert figures >= 5 and page.count('class="still" src="data:image/svg+xml,') == figures


# -- documents -------------------------------------------------------------------------------------------------


def test_figures_are_those_of_the_report(browser: Browser, study: dict[str, Any]) -> None:
    key = study["document"]
    document = browser.get(f"/api/documents/{key}").json()
    asks: tuple[tuple[str, dict[str, Any]], ...] = (
        ("", {}), ("?view=spectrum", {"view": "spectrum"}), ("?view=groups", {"view": "groups"}),
        ("?without=N", {"without": ["N"]}),
    )  # fmt: skip
    for asked, options in asks:
        found = browser.get(f"/api/documents/{key}/figure{asked}")
        assert found.status_code == 200, found.text
        assert found.json() == json.loads(json.dumps(figure_of(document, **options)))
    everything, fewer = (figure_of(document, **o) for o in ({}, {"without": ["N", "B", "G", "K", "R", "Q"]}))
    assert len(json.dumps(fewer)) < len(json.dumps(everything))
    for bad, said in (
        ("view=x", "there are: channels"),
        ("without=W", "no noise term"),
        ("channels=x", "no channel"),
    ):
        answer = browser.get(f"/api/documents/{key}/figure?{bad}")
        assert answer.status_code == 400 and said in answer.json()["error"]["message"]
    with pytest.raises(InputError, match="over the curves of a study"):
        figure_of({"format": "allanite-plan"}, without=["N"])


def test_table_of_a_study(browser: Browser, study: dict[str, Any]) -> None:
    document = browser.get(f"/api/documents/{study['document']}").json()
    table = browser.get(f"/api/documents/{study['document']}/parameters").json()
    assert table == parameters_of(document)
    (channel,) = table["channels"]
    rows = {r["symbol"]: r for r in channel["models"][0]["rows"]}
    estimates = {e["symbol"]: e for e in document["channels"][0]["models"][0]["estimates"]}
    white = rows["N"]
    assert (white["value"], white["lower"], white["upper"]) == tuple(
        estimates["N"][k] for k in ("value", "lower", "upper")
    )
    assert white["unit"] == "rad/s/√Hz" and white["status"] == "resolved" and white["says"].endswith("deg/√h")
    factors = {u["unit"]: u["factor"] for u in white["units"]}
    assert factors["rad/s/√Hz"] == 1.0 and next(iter(factors)) == "deg/√h"
    assert factors["deg/√h"] == pytest.approx(math.degrees(60), rel=1e-12)
    assert factors["deg/h/√Hz"] == pytest.approx(math.degrees(3600), rel=1e-12)
    assert {r["status"] for r in rows.values()} <= {"resolved", "upper limit", "not resolved"}


def test_models_of_a_fit_lie_over_the_curve(browser: Browser, study: dict[str, Any]) -> None:
    root = browser.app.settings.folder
    model = al.NoiseModel.of(al.noise.White(N=5e-4)).to_json()
    (root / "models.json").write_text(json.dumps({"gyro": model}))
    key = {d["name"]: d["id"] for d in browser.get("/api/catalogue").json()["documents"]}["models.json"]
    over = browser.get(f"/api/documents/{study['document']}/figure", params={"models": key})
    assert over.status_code == 200
    assert over.json() != browser.get(f"/api/documents/{study['document']}/figure").json()
    assert browser.get(f"/api/documents/{key}/figure").status_code == 200


def test_results_that_only_commands_make_are_shown(browser: Browser) -> None:
    from sample_calibration import estimate

    folder = browser.app.settings.folder / "by-hand"
    folder.mkdir()
    (folder / "calibration.json").write_text(json.dumps(estimate().to_json()))
    (folder / "broken.json").write_text('{"format": "allanite-north", "version": 1}')
    ids = {d["name"]: d["id"] for d in browser.get("/api/catalogue").json()["documents"]}
    found = browser.get(f"/api/documents/{ids['by-hand/calibration.json']}/said")
    assert found.status_code == 200, found.text
    said_as_by(text_of(al_report.html_of(estimate())), estimate().to_json())
    broken = browser.get(f"/api/documents/{ids['by-hand/broken.json']}/said")
    assert broken.status_code == 400 and "verdict is missing" in broken.json()["error"]["message"]
    assert browser.get("/api/catalogue").status_code == 200


# -- the queue -------------------------------------------------------------------------------------------------

_LONG = ("record", "simulated", "--model=N=0.3 deg/√h", "--rate=1", "--duration=600", "--out=allanite-runs")
"""Ten minutes of work that costs nothing."""


def crashing_mat(path: Path) -> None:
    """A file of MATLAB with one byte changed, which ends SciPy's parser by a signal."""
    from scipy.io import savemat

    savemat(path, {"x": np.arange(12.0).reshape(6, 2)})
    content = bytearray(path.read_bytes())
    content[176] ^= 0x5B
    path.write_bytes(content)


def test_w10_crashes_cancelling_and_a_full_queue(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    small_log(tmp_path / "data")
    crashing_mat(tmp_path / "data" / "broken.mat")
    with Browser(application(tmp_path / "data", tmp_path / "cache", workers=1, queue=50)) as browser:
        jobs = browser.app.jobs
        broken = browser.start(kind="check", recording=browser.recording("broken.mat"))
        assert (done := browser.wait(broken))["state"] == "failed" and "broken.mat" in done["message"]
        said = {r["name"]: r["refused"] for r in browser.get("/api/catalogue").json()["recordings"]}
        assert "broken.mat" in said["broken.mat"] and said["gyro.csv"] is None

        def long_job(number: int) -> Any:
            folder = tmp_path / f"result{number}"
            job = jobs.submit(
                Work(kind="long", title="ten minutes", argv=_LONG, cwd=tmp_path / "data", folder=folder)
            )
            until = time.monotonic() + 60
            while len(list(tmp_path.glob("data/allanite-runs/*"))) < number and time.monotonic() < until:
                time.sleep(0.02)
            assert job.state == "running"
            return job

        # the process dies in the middle
        spent: list[float] = []
        job = long_job(1)
        os.kill(job.child._process.pid, signal.SIGSEGV)
        failed = browser.wait({"id": job.id})
        assert failed["state"] == "failed" and "SIGSEGV" in failed["message"] and not job.work.folder.exists()
        # ten minutes are cut short at once; twice more where the machine was busy just then
        for number in (2, 3, 4):
            job = long_job(number)
            family = job.child._process.pid
            began = time.monotonic()
            assert browser.post(f"/api/jobs/{job.id}/cancel").json()["job"]["state"] == "cancelled"
            spent.append(time.monotonic() - began)
            assert not Path(f"/proc/{family}").exists()
            if spent[-1] < 1.0:
                break
        assert min(spent) < 1.0
        # and with fifty jobs behind them
        cut = number
        job = long_job(number + 1)
        family = job.child._process.pid
        key = browser.recording("gyro.csv")
        plan = {
            "kind": "plan",
            "model": _WORDS,
            "options": {"latitude": LATITUDE, "dwells": [30], "durations": [600]},
        }
        waiting = [browser.start(**plan) for _ in range(50)]
        assert len({shlex.split(w["command"])[-1] for w in waiting}) == 50  # each its own folder
        assert [w["place"] for w in waiting] == list(range(1, 51))
        refused = browser.post("/api/jobs", {"kind": "check", "recording": key})
        assert (
            refused.status_code == 429 and "50 jobs are already waiting" in refused.json()["error"]["message"]
        )
        assert browser.get("/api/catalogue").status_code == 200
        assert browser.post(f"/api/jobs/{job.id}/cancel").json()["job"]["state"] == "cancelled"
        assert not Path(f"/proc/{family}").exists()
        for one in waiting[1:]:
            assert browser.post(f"/api/jobs/{one['id']}/cancel").json()["job"]["state"] == "cancelled"
        first = browser.wait(waiting[0])
        assert first["state"] == "done", first["message"]
        results = sorted(p.name for p in (tmp_path / "data" / "allanite-results").iterdir())
        assert results == ["plan"]  # nothing stays of what was cancelled
        again = browser.post(f"/api/jobs/{waiting[0]['id']}/cancel").json()["job"]
        assert again["state"] == "done"
        states = [j["state"] for j in browser.get("/api/jobs").json()["jobs"]]
        assert states.count("cancelled") == 49 + cut and states.count("failed") == 2
        assert browser.get(f"/api/jobs/{job.id}/document").status_code == 409


def test_no_two_jobs_have_a_folder_of_one_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither after one was cancelled, nor where another program takes the name in between."""
    (tmp_path / "data").mkdir()
    small_log(tmp_path / "data")
    browser = Browser(application(tmp_path / "data", tmp_path / "cache", workers=0))  # nothing is run
    request = {"kind": "check", "recording": browser.recording("gyro.csv")}

    def folder_of(job: dict[str, Any]) -> str:
        return str(browser.app.jobs.get(job["id"]).work.folder.name)  # type: ignore[union-attr]

    first = browser.start(**request)
    assert browser.post(f"/api/jobs/{first['id']}/cancel").json()["job"]["state"] == "cancelled"
    assert not list((tmp_path / "data" / "allanite-results").iterdir())
    assert folder_of(browser.start(**request)) == "gyro-check-2" != folder_of(first)
    made, taken = page_jobs._make, []

    def late(work: Work) -> None:
        if not taken:
            taken.append(work.folder)
            work.folder.mkdir()  # type: ignore[union-attr]
        made(work)

    monkeypatch.setattr(page_jobs, "_make", late)
    assert folder_of(browser.start(**request)) == "gyro-check-4" and taken[0].name == "gyro-check-3"
    (tmp_path / "data" / "allanite-results" / "gyro-check-5").symlink_to(tmp_path / "none")
    assert folder_of(browser.start(**request)) == "gyro-check-6"
    named = {"kind": "check", "recording": request["recording"]}
    shown = browser.post("/api/jobs/preview", named).json()
    assert shown["command"] == "allanite info gyro.csv --json"


def test_events_tell_of_every_change(browser: Browser, study: dict[str, Any]) -> None:
    from allanite.commands.page.events import Streams

    over = {"now": False}
    changes = iter([[("jobs", {"jobs": []})], [("job", {"id": "x", "title": "a\nb"})]])

    def news() -> Any:
        found = next(changes, None)
        over["now"] = found is None
        return found or []

    async def read() -> str:
        answer = Streams(4).stream(news, over=lambda: over["now"])
        return b"".join([part async for part in answer.body_iterator]).decode()  # type: ignore[misc]

    import asyncio

    text = asyncio.run(read())
    assert text.split("\n\n")[1:3] == [
        'event: jobs\ndata: {"jobs":[]}',
        'event: job\ndata: {"id":"x","title":"a\\nb"}',
    ]


def test_check_tells_the_health_of_a_recording(
    browser: Browser, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    x = noise()
    x[100:130] = np.nan
    root = browser.app.settings.folder
    write_recording(Recording.from_rate(x, rate=10.0, unit="rad/s", names=["gyro"]), root / "holes.csv")
    done = browser.wait(browser.start(kind="check", recording=browser.recording("holes.csv")))
    assert (done["state"], done["exit"], done["lossy"]) == ("done", 3, True)
    facts = browser.get(f"/api/jobs/{done['id']}/document").json()
    assert facts["missing"] == 30 and facts["source"] == "holes.csv"
    monkeypatch.chdir(root)
    assert facts == json.loads(run(*shlex.split(done["command"])[1:]).out)
    space: dict[str, Any] = {}
    exec(done["python"], space)
    assert json.loads(json.dumps(space["facts"])) == facts
    health = next(r for r in browser.get("/api/catalogue").json()["recordings"] if r["name"] == "holes.csv")[
        "health"
    ]
    assert (
        health["from"] == "check"
        and health["worst"] in ("warning", "good")
        and health["info"] + health["warning"] > 0
    )
