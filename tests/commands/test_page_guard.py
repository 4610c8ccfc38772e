# SPDX-License-Identifier: BSD-3-Clause
"""Who may ask the page: every route without a session, foreign hosts and origins, ids that are none (W1 to W7, W9)."""

from __future__ import annotations

import ast
import inspect
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import httpx2 as httpx
import pytest
from starlette.routing import Route

from allanite.commands.page import guard
from allanite.commands.page.application import Application
from allanite.commands.page.catalogue import Catalogue
from allanite.commands.page.server import address_of
from allanite.commands.page.settings import Settings, checked_settings
from allanite.errors import InputError
from allanite.views.figures import screen
from page_client import BASE, PORT, Browser, application, small_log
from shell import Run


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> Application:
    root = tmp_path_factory.mktemp("page")
    data = root / "data"
    data.mkdir()
    small_log(data)
    (root / "data2").mkdir()
    small_log(root / "data2", "secret.csv")
    return application(data, root / "cache")


@pytest.fixture
def browser(app: Application) -> Browser:
    return Browser(app)


def routes(app: Application) -> list[tuple[str, str]]:
    """Method and address of every route, ids filled in."""
    found = [
        (m, r.path)
        for r in app.app.routes
        if isinstance(r, Route)
        for m in sorted(r.methods or ())
        if m != "HEAD"
    ]
    assert len(found) >= 28
    return [(m, re.sub(r"\{\w+\}", "a" * 24, path)) for m, path in found]


def asked(client: Any, method: str, path: str, **headers: str) -> httpx.Response:
    known = {"Origin": BASE, "Content-Type": "application/json", **headers}
    return client.request(
        method, path, headers={k: v for k, v in known.items() if v}, **({"content": b"{}"} if method == "POST" else {})
    )  # fmt: skip


def test_w2_no_route_is_open_without_the_session(app: Application, tmp_path: Path) -> None:
    stranger = Browser(app, enter=False).client
    other = application(app.settings.folder, tmp_path).settings
    cookies = {
        "none": "",
        "wrong": f"allanite-{PORT}=" + "x" * 43,
        "another run's": f"allanite-{PORT}={other.session}",
        "the token itself": f"allanite-{PORT}={app.settings.token}",
        "another port's": f"allanite-{PORT + 1}={app.settings.session}",
        "broken": 'allanite-8123="; Path=/',
    }
    for method, path in [*routes(app), ("GET", "/no/such"), ("POST", "/api")]:
        for what, cookie in cookies.items():
            answer = asked(stranger, method, path, Cookie=cookie)
            assert answer.status_code == 401, (method, path, what)
            assert "set-cookie" not in answer.headers
            assert app.settings.csrf not in answer.text
    for token in ("", "x", app.settings.token[:-1], other.token, f"{app.settings.token}&token=x", "%FF"):
        assert asked(stranger, "GET", f"/?token={token}").status_code == 401
    assert asked(stranger, "GET", f"/api/session?token={app.settings.token}").status_code == 401
    assert asked(stranger, "PUT", "/api/session").status_code == 405


def test_w2_secrets_are_compared_in_constant_time() -> None:
    tree = ast.parse(inspect.getsource(guard))
    secrets = {"token", "session", "csrf"}
    compared = [
        node for node in ast.walk(tree) if isinstance(node, ast.Compare)
        for part in ast.walk(node) if isinstance(part, ast.Attribute) and part.attr in secrets
    ]  # fmt: skip
    assert not compared
    calls = [
        n for n in ast.walk(tree) if isinstance(n, ast.Call) and getattr(n.func, "id", "") == "compare_digest"
    ]
    used = {p.attr for call in calls for p in ast.walk(call) if isinstance(p, ast.Attribute)}
    assert secrets <= used


def test_session_is_a_cookie_that_scripts_and_other_sites_do_not_get(app: Application) -> None:
    client = Browser(app, enter=False).client
    page = client.get(f"/?token={app.settings.token}")
    cookie = page.headers["set-cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie and "Path=/" in cookie
    assert app.settings.token not in cookie and app.settings.token not in page.text
    assert client.get("/").status_code == 200  # the cookie alone, as after a reload
    assert client.get("/api/session").json()["csrf"] == app.settings.csrf


@pytest.mark.parametrize(
    ("host", "status"),
    [
        (f"127.0.0.1:{PORT}", 200), (f"localhost:{PORT}", 200), (f"LocalHost:{PORT}", 200), (f"[::1]:{PORT}", 200),
        ("evil.com", 403), (f"evil.com:{PORT}", 403), (f"127.0.0.1.evil.com:{PORT}", 403), ("127.0.0.1", 403),
        (f"127.0.0.1:{PORT + 1}", 403), (f"127.0.0.1:{PORT}.evil.com", 403), (f"192.168.1.5:{PORT}", 403),
        (f"evil.com@127.0.0.1:{PORT}", 403), ("[::1]", 403), ("", 400),
    ],
)  # fmt: skip
def test_w3_host_must_be_this_server(browser: Browser, host: str, status: int) -> None:
    assert browser.get("/api/session", headers={"Host": host}).status_code == status


def test_w3_host_is_named_once(app: Application) -> None:
    scope = {"type": "http", "method": "GET", "path": "/", "query_string": b""}
    assert answered(app, {**scope, "headers": []}) == 400
    twice = [(b"host", f"127.0.0.1:{PORT}".encode()), (b"host", b"evil.com")]
    assert answered(app, {**scope, "headers": twice}) == 400


def answered(app: Application, scope: dict[str, Any]) -> int:
    """Status of a request as a server would hand it over."""
    import asyncio

    sent: list[Any] = []

    async def ask() -> None:
        async def receive() -> Any:
            return {"type": "http.request", "body": b"", "more_body": False}

        async def send(message: Any) -> None:
            sent.append(message)

        await guard.Guard(app.app, app.settings)(scope, receive, send)

    asyncio.run(ask())
    return int(sent[0].get("status", sent[0].get("code", 0)))


@pytest.mark.parametrize(
    "origin", ["https://evil.com", "null", f"https://127.0.0.1:{PORT}", f"http://127.0.0.1:{PORT + 1}", ""]
)
def test_w4_foreign_origins_change_nothing(browser: Browser, app: Application, origin: str) -> None:
    for method, path in routes(app):
        if method == "POST":
            answer = asked(browser.client, method, path, Origin=origin, **{"X-CSRF-Token": browser.csrf})
            assert answer.status_code == 403, path
    if origin:
        assert asked(browser.client, "GET", "/api/session", Origin=origin).status_code == 403


def test_w4_web_sockets_are_not_offered(app: Application) -> None:
    scope = {"type": "websocket", "path": "/api/jobs/events", "headers": [], "query_string": b""}
    assert answered(app, scope) == 1008


def test_other_sites_of_the_same_machine_are_foreign(browser: Browser) -> None:
    for site in ("cross-site", "same-site"):
        headers = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": "cors"}
        assert browser.get("/api/catalogue", headers=headers).status_code == 403
        assert browser.get("/", headers={**headers, "Sec-Fetch-Mode": "navigate"}).status_code == 200
    assert browser.get("/api/catalogue", headers={"Sec-Fetch-Site": "same-origin"}).status_code == 200


def test_w5_what_changes_something_needs_the_secret_and_its_type(browser: Browser, app: Application) -> None:
    posts = [path for method, path in routes(app) if method == "POST"]
    assert len(posts) >= 8
    for path in posts:
        for secret in ("", "wrong", app.settings.token, app.settings.session):
            assert asked(browser.client, "POST", path, **{"X-CSRF-Token": secret}).status_code == 403
        simple = {"X-CSRF-Token": browser.csrf, "Content-Type": "text/plain"}
        assert asked(browser.client, "POST", path, **simple).status_code == 415
    assert (
        asked(browser.client, "POST", "/api/jobs/preview", **{"X-CSRF-Token": browser.csrf}).status_code
        == 400
    )


_IDS = [
    "../gyro.csv", "%2e%2e%2fgyro.csv", "..%5cgyro.csv", "%2fetc%2fpasswd", "..%2fdata2%2fsecret.csv", "data2",
    "gyro.csv", "%00", "gyro.csv%00", "link.csv", "a" * 24, "A" * 24, "%2e%2e", "%2e", "é", "0" * 5000,
]  # fmt: skip


@pytest.mark.parametrize("given", _IDS)
def test_w6_ids_are_no_paths(browser: Browser, app: Application, given: str) -> None:
    link = app.settings.folder / "link.csv"
    if not link.is_symlink():
        link.symlink_to(app.settings.folder.parent / "data2" / "secret.csv")
    assert set(browser.names()) == {"gyro.csv"}  # the link leads out
    first = (app.settings.folder / "gyro.csv").read_text()[:40]
    for route in ("/api/documents/{}", "/api/documents/{}/figure", "/api/documents/{}/files/0", "/api/series/{}",
                  "/api/series/{}/window", "/api/jobs/{}", "/api/jobs/{}/files/0", "/static/{}",
                  "/api/runs/{}/events"):  # fmt: skip
        answer = browser.get(route.format(given))
        assert answer.status_code in (404, 405) and first not in answer.text, route
    answer = browser.post(f"/api/recordings/{given}/open")
    assert answer.status_code in (404, 405)
    for request in ({"kind": "check", "recording": given}, {"kind": "export", "document": given},
                    {"kind": "compare", "recordings": [given, given]}):  # fmt: skip
        extra = {"options": {"consumer": "kalibr"}} if request["kind"] == "export" else {}
        assert browser.post("/api/jobs", {**request, **extra}).status_code == 404


def test_w6_a_file_that_becomes_a_link_outside_is_gone(browser: Browser, app: Application) -> None:
    place = small_log(app.settings.folder, "swapped.csv")
    key = browser.recording("swapped.csv")
    place.unlink()
    place.symlink_to(app.settings.folder.parent / "data2" / "secret.csv")
    assert browser.post("/api/jobs/preview", {"kind": "check", "recording": key}).status_code == 404
    place.unlink()


@pytest.mark.parametrize("wanted", ["//host", "\\\\tree", "///google.com", "https://evil.com"])
def test_w7_nothing_leads_elsewhere(browser: Browser, app: Application, wanted: str) -> None:
    for path in ("/", "/api/session", f"/?token={app.settings.token}"):
        answer = browser.client.get(path, params={"next": wanted}, follow_redirects=False)
        assert answer.status_code in (200, 401) and "location" not in answer.headers


def test_w9_every_answer_forbids_foreign_and_inline_scripts(browser: Browser, app: Application) -> None:
    for method, path in [*routes(app), ("GET", "/no/such")]:
        if path.endswith("/events"):
            continue
        answer = asked(browser.client, method, path)
        policy = answer.headers["content-security-policy"]
        assert "script-src 'self'" in policy and "frame-ancestors 'none'" in policy
        assert (
            "unsafe-eval" not in policy and "script-src 'self' 'unsafe" not in policy and "http" not in policy
        )
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["referrer-policy"] == "no-referrer"
        assert not [h for h in answer.headers if h.startswith("access-control-")]
    page = browser.get("/").text
    assert not re.search(r"<script(?![^>]*\bsrc=)|\son\w+=|javascript:", page, re.I)
    assert not re.search(r"""(?:src|href)=["'](?!/|#|data:)""", page)  # W11: nothing from elsewhere


def test_w9_names_are_text(tmp_path: Path) -> None:
    name = '"><script>alert(1)<|script>&<img src=x onerror=alert(1)>.csv'
    small_log(tmp_path).rename(tmp_path / name)
    browser = Browser(application(tmp_path, tmp_path / ".cache"))
    answer = browser.get("/api/catalogue")
    assert answer.headers["content-type"] == "application/json"
    assert answer.json()["recordings"][0]["name"] == name
    previewed = browser.post(
        "/api/jobs/preview", {"kind": "characterize", "recording": browser.recording(name)}
    ).json()
    import shlex

    words = shlex.split(previewed["command"])
    assert words[2] == name and ".." not in words[-1]
    assert re.fullmatch(r"--out=allanite-results/[\w-]+", words[-1])
    compile(previewed["python"], "lines", "exec")


def test_figures_are_drawn_by_our_own_script_with_no_style_in_the_page(browser: Browser) -> None:
    page = browser.get("/")
    assert "style-src 'self';" in page.headers["content-security-policy"]
    assert "<style" not in page.text and " style=" not in page.text
    script, style = browser.get("/static/chart.js"), browser.get("/static/chart.css")
    assert script.text == screen.script() and "--of-grid" in style.text
    again = browser.get("/static/chart.js", headers={"If-None-Match": script.headers["etag"]})
    assert again.status_code == 304


def test_w1_another_address_needs_a_token(tmp_path: Path, run: Run) -> None:
    done = run("serve", tmp_path, "--host", "0.0.0.0", "--no-browser")
    assert done.code == 1 and "--token" in done.err and "not encrypted" in done.err
    with pytest.raises(InputError, match="16 ASCII characters"):
        checked_settings(tmp_path, host="0.0.0.0", token="short")
    with pytest.raises(InputError, match="no such folder"):
        checked_settings(tmp_path / "none", host=None, token=None)
    assert checked_settings(tmp_path, host="0.0.0.0", token="k" * 16)[1] == "0.0.0.0"
    assert checked_settings(tmp_path, host=None, token=None)[1] == "127.0.0.1"
    log = tmp_path / "log.xyz"
    log.write_bytes(b"no recording that anything knows")
    assert checked_settings(log, host=None, token=None)[0] == tmp_path.resolve()
    # A log that is named is opened first, and listed whatever it looks like: its reader says what it is.
    settings = Settings(folder=tmp_path, port=1, cache=tmp_path / "cache", log=log)
    (listed,) = Catalogue(settings).scan()["recordings"]
    assert address_of(settings).endswith(f"#/recording/{listed['id']}") and listed["name"] == "log.xyz"
    served = Settings(folder=tmp_path, host="0.0.0.0", port=80, cache=tmp_path)
    door = guard.Guard(lambda *_: None, served)  # type: ignore[arg-type,return-value]
    assert door._is_own("192.168.1.5") and door._is_own("[fe80::1]:80") and not door._is_own("evil.com")


def test_w1_the_program_listens_on_this_machine_alone(tmp_path: Path) -> None:
    small_log(tmp_path)
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / ".cache"), "PYTHONUNBUFFERED": "1"}
    server = subprocess.Popen(
        [sys.executable, "-m", "allanite", "serve", str(tmp_path), "--no-browser"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
    )  # fmt: skip
    try:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/\?token=[\w-]{43}", address)
        assert found, address
        with httpx.Client() as client:
            assert client.get(address).status_code == 200
            base = address.split("/?")[0]
            spent = []
            for _ in range(40):
                began = time.perf_counter()
                assert client.get(f"{base}/api/jobs").status_code == 200
                spent.append(time.perf_counter() - began)
            assert min(spent) < 0.035  # no answer waits for the other side's word (40 ms)
            assert client.get(f"{base}/api/jobs", headers={"Host": "evil.com"}).status_code == 403
        assert listeners(int(found[1])) <= {"127.0.0.1"}
        children = Path(f"/proc/{server.pid}/task/{server.pid}/children")
        family = [] if not children.exists() else children.read_text().split()
    finally:
        server.send_signal(signal.SIGINT)
        _, said = server.communicate(timeout=20)
    assert server.returncode == 0, said
    assert not [pid for pid in family if Path(f"/proc/{pid}").exists()]


def listeners(port: int) -> set[str]:
    """Addresses on which somebody listens at a port, as the system says."""
    if shutil.which("ss") is None:
        return set()
    done = subprocess.run(["ss", "-Hltn", f"sport = :{port}"], capture_output=True, text=True, check=True)
    found = {line.split()[3].rpartition(":")[0] for line in done.stdout.splitlines()}
    assert found
    return found
