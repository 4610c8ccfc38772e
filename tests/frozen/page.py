# SPDX-License-Identifier: BSD-3-Clause
"""What the page offers: its forms, and the command and the lines of Python of each job, asked as a browser does."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from http.cookiejar import CookieJar
from pathlib import Path
from typing import Any

from tests.frozen.compared import lines_of

__all__ = ["offered"]

_TOKEN = "frozen-frozen-frozen-frozen-frozen-frozen"


class _Browser:
    def __init__(self, address: str) -> None:
        self._base = address.partition("/?")[0]
        self._opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
        page = self._opener.open(address, timeout=60).read().decode()
        found = re.search(r'name="csrf-token" content="([^"]+)"', page)
        assert found is not None
        self._csrf = found[1]

    def ask(self, path: str, data: dict[str, Any] | None = None) -> Any:
        headers = {"Content-Type": "application/json", "X-CSRF-Token": self._csrf, "Origin": self._base}
        body = None if data is None else json.dumps(data).encode()
        request = urllib.request.Request(self._base + path, body, headers if data is not None else {})
        try:
            answer = self._opener.open(request, timeout=60)
        except urllib.error.HTTPError as error:
            answer = error
        return json.loads(answer.read())


_VALUES: dict[str, Any] = {
    "number": 1.5, "integer": 12, "text": "wx", "flag": True, "names": ["a", "b"], "texts": ["clipping"],
    "by-channel": {"gyro": "deg/s"}, "seconds": 90, "seconds-list": [1, 60], "degrees": 48.1, "latitude": 48.1,
    "deg/s": 6, "deg/h": 0.5, "deg/h/g": 0.1, "spans": [[1, 2], [3, 4]], "turns": [[1, 2], [3, 4]],
    "headings": [[0, 60, 0], [60, 120, 90]],
    "model": {"words": "N=0.3 deg/√h"},
}  # fmt: skip


def offered(folder: Path) -> str:
    """The forms of the page as lines, and what it would run for each option of each kind of job."""
    with _served(folder) as address:
        browser = _Browser(address)
        session = browser.ask("/api/session")
        catalogue = browser.ask("/api/catalogue")
        logs, results = catalogue["recordings"], catalogue["documents"]
        ids = {one["id"]: f"<id of {one['name']}>" for one in (*logs, *results)}
        lines = [
            line
            for line in lines_of(session, "session")
            if not re.match(r"session\.(csrf|version|wor)", line)
        ]
        given = {"recording": {"recording": logs[0]["id"]}, "recordings": {"recordings": list(ids)[:2]},
                 "document": {"document": results[0]["id"]}, "model": {"model": {"words": "N=0.3 deg/√h"}}}  # fmt: skip
        for name, kind in session["kinds"].items():
            request = {"kind": name, **given[kind["takes"]]}
            needed = {key: _value(kind["options"][key], ids) for key in kind["required"]}
            needed |= {"consumer": "kalibr"} if name == "export" else {}
            for option, facts in {"": {}, **kind["options"]}.items():
                options = {**needed, **({option: _value(facts, ids)} if option else {})}
                shown = browser.ask("/api/jobs/preview", {**request, "options": options})
                if "python" in shown:
                    shown["python"] = _without_modules(shown["python"]).splitlines()
                lines += lines_of(shown, f"{name} {option}".strip())
    text = "\n".join(lines) + "\n"
    for id_, word in ids.items():
        text = text.replace(id_, word)
    return text


def _without_modules(code: str) -> str:
    """Python without the places of its names in the package: they may move."""
    for module in set(re.findall(r"\bfrom allanite import ([a-z_]+)", code)):
        code = re.sub(rf"\b{module}\.(?=[a-z_]+\()", "", code)
    return re.sub(r"^from allanite.*\n", "", code, flags=re.M)


def _value(option: dict[str, Any], ids: dict[str, str]) -> Any:
    """Something that an option may be set to."""
    if option["type"] == "choice":
        return option["choices"][-1]
    return _VALUES.get(option["type"], next(iter(ids)))


@contextmanager
def _served(folder: Path) -> Iterator[str]:
    """The address of a server in a process of its own, which ends with it."""
    command = [sys.executable, "-m", "allanite", "serve", str(folder), "--no-browser", "--token", _TOKEN]
    environment = {**os.environ, "XDG_CACHE_HOME": str(folder / ".cache"), "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
    ) as server:
        try:
            assert server.stdout is not None
            said = ""
            for line in server.stdout:
                said += line
                found = re.search(r"http://\S+\?token=\S+", line)
                if found:
                    yield found[0]
                    break
            else:
                raise RuntimeError(f"allanite serve printed no address: {said}")
        finally:
            server.terminate()
            server.wait(60)
