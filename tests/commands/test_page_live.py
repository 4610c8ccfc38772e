# SPDX-License-Identifier: BSD-3-Clause
"""Captures from the page: started, watched, stopped; and recorders that do not notice that it is closed (row W12)."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.commands.page.attached import Named
from allanite.commands.page.live import Watcher
from allanite.files.store import open_run
from page_client import Browser, application


def until(what: Callable[[], Any], seconds: float = 60.0) -> Any:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := what():
            return found
        time.sleep(0.03)
    raise AssertionError("it did not come about")


def events(watcher: Watcher, name: str) -> list[Any]:
    return [data for _, event, data in watcher.since(0) if event == name]


def capture(browser: Browser, key: str) -> dict[str, Any]:
    return next(c for c in browser.get("/api/captures").json()["captures"] if c["id"] == key)


def test_a_capture_outlives_the_page(tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir()
    request = {
        "instrument": "simulated",
        "options": {
            "model": {"words": "N=0.3 deg/√h"}, "rate": 40, "speed": 20, "seed": 3, "duration": 36000, "unit": "deg/s",
        },
    }  # fmt: skip
    with Browser(application(data, tmp_path / "cache", captures=1)) as browser:
        answer = browser.post("/api/captures", request)
        assert answer.status_code == 201
        started = answer.json()["capture"]
        assert started["command"].startswith("allanite record simulated '--model=N=0.3 deg/√h'")
        refused = browser.post("/api/captures", request)
        assert refused.status_code == 429
        run_id = until(lambda: capture(browser, started["id"])["run"])
        folder = next((data / "allanite-runs").iterdir())
        until(lambda: open_run(folder).tail()[0])
        live = browser.app.live
        watcher = live.look(folder)
        assert live.look(folder) is watcher
        first = until(lambda: [e for e in events(watcher, "run") if e["series"] and e["curves"]])[-1]
        assert first["state"]["status"] == "recording" and first["state"]["missing"] == 0
        assert first["series"]["count"] == len(first["series"]["low"][0]) > 0
        assert set(first["curves"]) == {"gyro"} and first["curves"]["gyro"]["statistic"] == "oadev"
        assert json.dumps(first, allow_nan=False)
        until(lambda: events(watcher, "run")[-1]["state"]["samples"] > first["state"]["samples"])
        # who looks away and comes back has it all at once
        live.leave(watcher)
        assert not watcher.over
        live.leave(watcher)
        assert watcher.over and browser.app.live.look(folder) is not watcher
        listed = browser.get("/api/catalogue").json()["recordings"]
        assert [(r["id"], r["status"], r["is_run"]) for r in listed] == [(run_id, "recording", True)]
        figure = until(lambda: (a := browser.get(f"/api/runs/{run_id}/figure")).status_code == 200 and a)
        assert figure.json()["panels"]
        pid = browser.app.captures.get(started["id"]).pid
        before = len(list(open_run(folder).batches()))
    # the server has ended
    assert Path(f"/proc/{pid}").exists()
    until(lambda: len(list(open_run(folder).batches())) > before)
    # another one finds the recorder, and ends it as Ctrl-C does
    with Browser(application(data, tmp_path / "cache")) as browser:
        found = capture(browser, started["id"])
        assert found["state"] == "recording" and found["command"] == started["command"]
        assert browser.post(f"/api/captures/{started['id']}/stop").status_code == 200
        os.waitpid(pid, 0)
        assert capture(browser, started["id"])["state"] == "ended"
        run = open_run(folder)
        assert run.status == "abort"
        watcher = browser.app.live.look(folder)  # the end of a run that is over, with all of it
        last = until(lambda: events(watcher, "ended"))[-1]
        assert last["state"]["status"] == "abort" and last["state"]["missing"] == 0
        seen = events(watcher, "run")[-1]["series"]
        samples = run.recording().values("gyro")
        assert seen["size"] * seen["count"] >= len(samples) > seen["size"] * (seen["count"] - 1)
        assert max(h for h in seen["high"][0] if h is not None) == np.nanmax(samples)
        assert min(v for v in seen["low"][0] if v is not None) == np.nanmin(samples)
        assert browser.get("/api/captures").json()["captures"][0]["message"].count("Nothing is missing") == 1


def test_captures_refuse_what_they_cannot_do(tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir()
    (tmp_path / "frames.yaml").write_text("x: 1\n")
    known = Named(kind="serial", name="/dev/null", title="nothing")
    own = Named(kind="serial", name="/dev/zero", title="described", format=str(tmp_path / "frames.yaml"))
    browser = Browser(application(data, tmp_path / "cache", instruments=(known, own)))
    for request, status, said in (
        ({"instrument": "laser"}, 400, "no instrument"),
        ({"instrument": "simulated"}, 400, "give model"),
        ({"instrument": "simulated", "options": {"model": {"words": "N=1 deg/√h"}, "out": "/tmp"}}, 400, "no option"),
        ({"instrument": "3458a", "options": {"rate": 1}}, 400, "give resource"),
        ({"instrument": "serial", "options": {"port": known.id}}, 400, "give format"),
        ({"instrument": "serial", "options": {"port": known.id, "format": "../frames.yaml"}}, 404, "no description"),
        ({"instrument": "serial", "options": {"port": known.id, "format": 3}}, 404, "no description"),
        ({"instrument": "serial", "options": {"port": own.id, "format": "a" * 24}}, 400, "its own description"),
        ({"instrument": "serial", "options": {"port": "/dev/null", "format": "a" * 24}}, 404, "id of an attached"),
        ({"instrument": "3458a", "options": {"rate": 1, "resource": known.id}}, 404, "id of an attached"),
    ):  # fmt: skip
        answer = browser.post("/api/captures", request)
        assert answer.status_code == status and said in answer.json()["error"]["message"], answer.text
    assert browser.get("/api/captures").json() == {"captures": []}
    assert browser.post("/api/captures/abc/stop").status_code == 404
    assert browser.get("/api/runs/" + "a" * 24 + "/events").status_code == 404


def test_a_run_that_cannot_be_followed_says_so(tmp_path: Path) -> None:
    (tmp_path / "manifest.jsonl").write_text("{}\n")
    watcher = Watcher(tmp_path, {"task": "follow", "run": str(tmp_path)})
    failed = until(lambda: events(watcher, "failed"))
    assert failed[0]["message"]
    until(lambda: watcher.over)


def test_a_child_whose_server_is_gone_ends(tmp_path: Path, real_children: None) -> None:
    from allanite.commands.page.children import Child

    child = Child()
    words = ["record", "simulated", "--model=N=0.3 deg/√h", "--rate=1", "--duration=600", "--out=runs"]
    child.tell({"task": "command", "cwd": str(tmp_path), "argv": words})
    until(lambda: list(tmp_path.glob("runs/*")))
    assert child._process.stdin is not None
    child._process.stdin.close()  # as the system does for a server that was killed
    assert child.died() == f"by signal {signal.SIGKILL.value} (SIGKILL)"
    child.end()
    assert not Path(child.scratch).exists()


@pytest.mark.parametrize("seconds", [0.2])
def test_answers_that_take_too_long_are_given_up(seconds: float, tmp_path: Path, real_children: None) -> None:
    from allanite.commands.page.children import Quick
    from allanite.commands.page.replies import Refused

    quick = Quick(seconds)
    words = ["record", "simulated", "--model=N=0.3 deg/√h", "--rate=1", "--duration=600", f"--out={tmp_path}"]
    with pytest.raises(Refused, match="start it as a job"):
        quick.ask({"task": "command", "argv": words})
    quick._seconds = 30.0
    assert quick.ask({"task": "command", "argv": ["--version"]})["stdout"].startswith("allanite")
    quick.close()
