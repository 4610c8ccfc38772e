# SPDX-License-Identifier: BSD-3-Clause
"""The page in a real browser: from a dropped log to imu.yaml, refits, marks, reports, captures, keyboard, names.

Each test has a server, a folder and a window of its own, so that neither their order nor what runs beside them matters.
Waits are for conditions. Nothing but this machine can be reached from the browser (row W11).
"""

from __future__ import annotations

import json
import re
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.commands.page.attached import Named
from allanite.commands.page.server import address_of
from allanite.commands.page.settings import RESULTS
from allanite.commands.study import write_results
from allanite.errors import AllaniteError
from allanite.files.recording_file import write_recording
from allanite.recording.records import Recording
from axe import axe_script, violations
from page_client import served as serving
from real_browser import opened_browser
from sample_calibration import estimate

SERIES = ".series .plot[data-drawn]"
STUDY = ".study .noise .plot[data-drawn]"
PATIENCE = 60_000  # [ms] nobody is measured here
EVIL = "<img src=x onerror=alert(1)>"
EVIL_NAME = "<img/src=x/onerror=alert(1)>"
VIEWS = ("#/", "#/results", "#/compare", "#/plan", "#/capture")
DWELL, RATE = 20.0, 10.0
BENCH = Named(kind="serial", name="/dev/null", title="unit on the bench")
TABLE = Named(kind="serial", name="/dev/zero", title="unit on the table", format="/etc/x1.yaml")


def imu_log(path: Path, *, units: bool = True, n: int = 1500) -> Path:
    """A log of six axes at 50 Hz; in counts, without units and time, where that is asked for."""
    rng = np.random.default_rng(4)
    table = np.column_stack([rng.standard_normal((n, 3)) * 0.04, rng.standard_normal((n, 3)) * 0.01])
    table[:, 5] += 9.81
    if units:
        table = np.column_stack([np.arange(n) / 50.0, table])
    else:
        table = np.round(table * np.repeat([131.0, 16384 / 9.80665], 3))
    axes = [f"{kind}_{axis}" for kind in ("gyro", "acc") for axis in "xyz"]
    suffix = {"gyro": "_deg_s", "acc": "_m_s2"} if units else {"gyro": "", "acc": ""}
    names = ["time_s"] * units + [f"{a}{suffix[a[:-2]]}" for a in axes]
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="", fmt="%.6f")
    return path


def turned_take(path: Path) -> Path:
    """A gyro that was turned to and fro every 20 s, within a second."""
    n, each = int(10 * DWELL * RATE), int(DWELL * RATE)
    side = np.where((np.arange(n) // each) % 2 == 0, 1.0, -1.0)
    x = 1e-6 * np.random.default_rng(4).standard_normal(n) + 5e-5 * side
    for k in range(1, 10):
        x[k * each - 5 : k * each + 5] += (-1) ** k * np.pi
    return write_recording(Recording.from_rate(x, rate=RATE, unit="rad/s", names=["gyro"]), path)


@pytest.fixture(scope="module")
def calls() -> Iterator[set[Any]]:
    """Where this process, which holds the server, has connected to."""
    found: set[Any] = set()
    listening = [True]

    def heard(event: str, arguments: tuple[Any, ...]) -> None:
        if listening and event in ("socket.connect", "socket.getaddrinfo"):
            found.add(arguments[1] if event == "socket.connect" else arguments[0])

    sys.addaudithook(heard)  # cannot be taken away again, only made deaf
    yield found
    listening.clear()


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What lies in the folder of every test: logs, a study of one of them, a calibration."""
    folder = tmp_path_factory.mktemp("recordings")
    bench = imu_log(folder / "bench.csv")
    write_results(al.characterize(al.read(bench)), folder / RESULTS / "bench-characterize")
    turned_take(folder / "take.parquet")
    (folder / "calibration.json").write_text(json.dumps(estimate().to_json()))
    columns = "  columns:\n    - {name: gyro_z, column: 0, unit: deg/s}\n"
    (folder / "x1.yaml").write_text(f"model: X1\nrate: 100\nlines:\n{columns}")
    rows = "".join(f"{i / 10},{i % 7}\n" for i in range(300))
    (folder / "broken.parquet").write_bytes(b"PAR1" + bytes(400))
    (folder / f"{EVIL}.csv").write_text(f"time_s,{EVIL_NAME}\n{rows}")
    return folder


@pytest.fixture
def served(tmp_path: Path, recordings: Path, calls: set[Any]) -> Iterator[tuple[str, Path]]:
    """Address of a page, with its token, and its folder; the server connects to nobody."""
    folder = tmp_path / "recordings"
    shutil.copytree(recordings, folder)
    calls.clear()
    with serving(folder, tmp_path / "cache", look=0.2, instruments=(BENCH, TABLE)) as app:
        yield address_of(app.settings), folder
    outside = {
        a for a in calls if not (isinstance(a, str) and a.startswith("/")) and "127.0.0.1" not in str(a)
    }
    assert not outside


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """A browser to which only this machine has a name: the network is off."""
    alone = ["--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--no-proxy-server"]
    with opened_browser(*alone) as browser:
        yield browser


def complaining(view: Any, own: str) -> list[str]:
    """What a window complains of, and whom it asks besides its own server."""
    found: list[str] = []
    view.on("console", lambda m: found.append(m.text) if m.type in ("error", "warning") else None)
    view.on("pageerror", lambda error: found.append(str(error)))
    view.on("dialog", lambda dialog: found.append(f"dialog {dialog.message}"))
    view.on(
        "request",
        lambda r: None if r.url.startswith((own, "data:", "blob:")) else found.append(f"asks {r.url}"),
    )
    return found


@pytest.fixture
def window(chromium: Any, served: tuple[str, Path]) -> Iterator[Any]:
    """The window, and its complaints."""
    address, _ = served
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    context.set_default_timeout(PATIENCE)
    opened = context.new_page()
    complaints = complaining(opened, address.split("?")[0])
    opened.goto(address)
    yield opened, complaints
    context.close()


@pytest.fixture
def page(window: Any) -> Iterator[Any]:
    """The window at its beginning; it must neither complain nor ask anybody else."""
    opened, complaints = window
    go(opened, "#/")
    yield opened
    assert not complaints


def go(page: Any, address: str) -> None:
    page.evaluate("address => { location.hash = address; }", address)
    page.locator(f"html:has(#main-nav a[href='{address}'][aria-current]) main h1").wait_for()


def until(page: Any, what: Callable[[], Any]) -> Any:
    end = time.monotonic() + PATIENCE / 1000
    while time.monotonic() < end:
        if found := what():
            return found
        painted(page)
    raise AssertionError("it did not come about")


def painted(page: Any) -> None:
    """Once all is drawn that was asked for, and laid out."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def settled(page: Any, plot: Any) -> dict[str, float]:
    """Where a drawing is, once it does not move any more."""
    plot.scroll_into_view_if_needed()
    before: list[Any] = [None]

    def stays() -> Any:
        last, before[0] = before[0], plot.bounding_box()
        return before[0] if before[0] == last else None

    return dict(until(page, stays))


_AT_REST = """
async () => {
  const [own, work] = await Promise.all([import("/static/catalogue.js"), import("/static/work.js")]);
  const get = (path) => fetch(path).then((r) => r.json());
  const [{ jobs }, { recordings, documents }] = await Promise.all([get("/api/jobs"), get("/api/catalogue")]);
  const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
  const known = jobs.every((job) => work.isOver(job) && same(work.byId(job.id)?.state, job.state));
  return known && same(own.recordings(), recordings) && own.documents().length === documents.length;
}
"""


def at_rest(page: Any) -> None:
    """Once no work is open, and the page knows all that the server does: nothing is drawn anew after that."""
    page.get_by_text("Looking for instruments").wait_for(state="detached")
    until(page, lambda: page.evaluate(_AT_REST))


def studied(page: Any) -> None:
    """A recording with its series and its study."""
    page.locator("#side-files a", has_text="characterized").click()
    page.locator(SERIES).wait_for()  # with it come the forms
    page.locator(STUDY).wait_for()


def result_of(page: Any, folder: Path, words: str, where: str = ".study") -> Path:
    """The folder of the result that is shown, once it is the one of a command with these words."""
    code = page.locator(f"{where} .same code")
    shown = code.filter(has_text=words).filter(has_text="--out=")
    shown.first.wait_for(state="attached")
    named = re.search(r"--out=(\S+)", shown.first.text_content())
    assert named is not None
    return folder / named[1]


def stroke(page: Any, plot: Any, begin: float, end: float) -> None:
    """Draw over the series with the mouse."""
    box = settled(page, plot)
    page.mouse.move(box["x"] + begin, box["y"] + 60)
    page.mouse.down()
    for step in range(1, 5):  # as a hand does, which is slower than the drawing
        page.mouse.move(box["x"] + begin + (end - begin) * step / 4, box["y"] + 62)
        painted(page)
    page.mouse.up()


def band(page: Any, plot: Any) -> tuple[float, float]:
    """Ends of the first mark on the series in pixels, once it is drawn where its row says."""
    ends = """plot => {
      const path = plot.querySelector(".chart-mark[data-index='0']"), [panel] = plot.chart.panels;
      const rows = [...document.querySelectorAll(".marks input")].slice(0, 2).map((i) => Number(i.value));
      if (!path || plot.dataset.stroke !== "marks") return null;
      const { left, right } = path.getBoundingClientRect(), from = plot.getBoundingClientRect().left;
      const there = rows.map((value) => panel.px(value)), here = [left - from, right - from];
      return here.every((x, i) => Math.abs(x - there[i]) < 2) ? here : null;
    }"""
    return tuple(until(page, lambda: plot.evaluate(ends)))


# -- from a log to what one takes away ------------------------------------------------------------------------------


@pytest.mark.long
def test_from_a_dropped_log_to_imu_yaml_in_two_clicks(
    page: Any, served: tuple[str, Path], tmp_path: Path
) -> None:
    """And no click more, nor any scrolling; then other units, terms off, and a refit by pointing at the curve."""
    page.evaluate(
        "() => { window.clicks = 0; addEventListener('click', (e) => (window.clicks += e.isTrusted), true); }"
    )
    text = imu_log(tmp_path / "dropped.csv", n=600).read_text()
    page.evaluate(
        """text => {
             const held = new DataTransfer();
             held.items.add(new File([text], "dropped.csv"));
             const drop = { dataTransfer: held, bubbles: true, cancelable: true };
             document.body.dispatchEvent(new DragEvent("drop", drop));
           }""",
        text,
    )
    page.locator(SERIES).wait_for()
    assert "token" not in page.url
    button = page.get_by_role("button", name="Characterize", exact=True)
    assert on_screen(button)
    page.mouse.click(*middle(button))
    page.get_by_role("main").locator(".job-step", has_text=re.compile(r"\w")).wait_for()  # at once
    page.locator(".study table").nth(1).wait_for()
    # What one sees now: the verdict, all axes, and the button.
    verdict = page.get_by_role("region", name="Verdict")
    assert on_screen(verdict.locator(".banner").first)
    rows = verdict.locator(":scope > .wide tbody tr")
    assert rows.locator("th").all_text_contents() == [f"{k}_{a}" for k in ("gyro", "acc") for a in "xyz"]
    assert all(on_screen(row) for row in rows.all())
    button = page.get_by_role("button", name="imu.yaml")
    assert on_screen(button)
    with page.expect_download() as caught:
        page.mouse.click(*middle(button))
    assert page.evaluate("window.clicks") == 2
    page.locator(STUDY).wait_for()
    written = Path(caught.value.path()).read_text()
    own = result_of(page, served[1], "allanite characterize allanite-dropped/")
    assert written == (own / "imu.yaml").read_text()
    assert re.search(r"gyroscope_noise_density: \d", written)
    assert re.search(
        r"allanite characterize allanite-dropped/\S+ --out", page.locator(".study .same").text_content()
    )
    # The table says what the study says, in the unit that is chosen.
    row = page.locator(".parameters tbody tr", has_text="random walk").first
    in_people = float(row.locator(".value").text_content())
    row.get_by_role("combobox").select_option("rad/s/√Hz")
    assert float(row.locator(".value").text_content().replace("−", "-")) == pytest.approx(
        in_people / 3437.7467707849396, rel=1e-3
    )
    page.get_by_role("radio", name="One channel").check()
    page.get_by_label(re.compile("^N white")).uncheck()
    # A point of the curve is left out by a click on it, and comes back by the next.
    page.mouse.click(*pointed(page, 1))
    page.get_by_text("1 averaging time will be left out").wait_for()
    assert page.get_by_label("0.04 s", exact=True).is_checked()
    page.mouse.click(*pointed(page, 1))
    page.get_by_role("button", name="Fit again").wait_for(state="detached")
    page.mouse.click(*pointed(page, 1))
    page.get_by_role("button", name="Fit again").click()
    study = result_of(page, served[1], "--exclude=") / "study.json"
    curve = json.loads(study.read_text())["channels"][0]["curve"]
    left = [t for t, why in zip(curve["tau"], curve["excluded"], strict=True) if why == "left out by hand"]
    assert left == [0.04]


def on_screen(place: Any) -> bool:
    """Whether all of it is seen without scrolling."""
    box, window = place.bounding_box(), place.page.viewport_size
    return 0 <= box["y"] and box["y"] + box["height"] <= window["height"]


def middle(place: Any) -> tuple[float, float]:
    """Where a hand points at it: a click of the mouse does not scroll."""
    box = place.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_a_study_by_likelihood_has_no_averaging_times_to_leave_out(
    page: Any, served: tuple[str, Path]
) -> None:
    studied(page)
    again = page.get_by_role("region", name="Characterize", exact=True)
    again.locator("summary", has_text=re.compile("^Options$")).click()
    again.get_by_label("Method", exact=True).select_option("likelihood")
    page.get_by_role("button", name=re.compile("^Characterize")).click()
    study = result_of(page, served[1], "--method=likelihood") / "study.json"
    page.locator(STUDY).wait_for()
    page.get_by_role("radio", name="One channel").check()
    page.get_by_label(re.compile("^N white")).wait_for()
    assert not page.get_by_text("Leave averaging times out").count()
    (first, *_) = json.loads(study.read_text())["channels"][0]["models"]
    assert first["goodness"]["method"] == "likelihood"
    # what was asked for stays in the form
    assert again.get_by_label("Method", exact=True).input_value() == "likelihood"


def pointed(page: Any, number: int) -> tuple[float, float]:
    """Where a point of the Allan curve stands on the screen."""
    plot = page.locator(STUDY)
    settled(page, plot)
    x, y = plot.evaluate(
        """(plot, number) => {
             const [panel] = plot.chart.panels, box = panel.picture.getBoundingClientRect();
             const { x, y } = panel.facts.curves.find((c) => c.marker && c.lower);
             return [box.x + panel.px(x[number]), box.y + panel.py(y[number])];
           }""",
        number,
    )
    page.mouse.move(x - 3, y - 3)
    page.mouse.move(x, y, steps=2)
    return x, y


def test_what_is_offered_can_be_taken_away(page: Any, served: tuple[str, Path]) -> None:
    """Every format has its words and its options; one is written by the page as by the command."""
    studied(page)
    consumers = page.evaluate("fetch('/api/session').then((r) => r.json()).then((s) => s.consumers)")
    choice = page.get_by_label("Format", exact=True)
    offered = choice.locator("option").evaluate_all("all => all.map((o) => o.value)")
    assert offered == [c["name"] for c in consumers if c["takes"] != "calibration"] and len(offered) > 12
    for name in offered:
        choice.select_option(name)
        (known,) = (c for c in consumers if c["name"] == name)
        assert page.get_by_text(known["summary"], exact=True).is_visible()
    choice.select_option("gtsam")
    with page.expect_download() as caught:
        page.get_by_role("button", name="Export", exact=True).click()
    file = Path(caught.value.path()).read_text()
    assert file in [p.read_text() for p in served[1].glob("allanite-results/*-gtsam/*")]
    names = page.locator(".study .take a").evaluate_all("all => all.map((a) => a.textContent)")
    assert {"allan.csv", "study.json"} <= set(names)


def test_report_in_one_click_is_complete_without_a_network(page: Any, chromium: Any, tmp_path: Path) -> None:
    """Opened from the disk; read without scripts; printed, and the page itself printed, on a few pages."""
    studied(page)
    with page.expect_download() as caught:
        page.get_by_role("button", name="Report", exact=True).click()
    place = tmp_path / "report.html"
    caught.value.save_as(place)
    assert place.stat().st_size < 6e6
    context = chromium.new_context(offline=True)
    view = context.new_page()
    troubles = complaining(view, place.as_uri())
    view.goto(place.as_uri())
    count = view.locator("figure .live").count()
    fold = "(all, open) => all.forEach((d) => (d.open = open))"
    view.locator("details:not([open])").evaluate_all(fold, True)
    for figure in view.locator("figure .live").all():
        figure.scroll_into_view_if_needed()
        figure.locator(".chart-picture").first.wait_for()
    view.locator("details").evaluate_all(fold, False)
    assert count >= 3 and view.get_by_text("gyroscope", exact=False).count()
    assert not troubles
    assert 2 <= pages_of(view.pdf(prefer_css_page_size=True)) <= 12
    context.close()
    plain = chromium.new_context(offline=True, java_script_enabled=False)
    view = plain.new_page()
    view.goto(place.as_uri())
    stills = view.locator("figure img.still")
    assert stills.count() == count and stills.first.is_visible()
    assert view.locator("section table").count() >= 2
    plain.close()
    assert 1 <= pages_of(page.pdf(prefer_css_page_size=True)) <= 12  # it says what the report says
    page.emulate_media(media="print")
    assert not page.locator("body > header").is_visible() and not page.locator("aside").is_visible()
    assert page.locator(".study").get_by_role("heading", name="Verdict", exact=True).is_visible()
    page.emulate_media(media="screen")


def pages_of(pdf: bytes) -> int:
    assert pdf.startswith(b"%PDF")
    return len(re.findall(rb"/Type\s*/Page\b", pdf))


# -- series, marks, work ---------------------------------------------------------------------------------------------


def test_zoom_shows_every_sample_and_work_is_cancelled(page: Any) -> None:
    page.get_by_role("link", name="bench.csv").first.click()
    plot = page.locator(SERIES)
    plot.wait_for()
    stroke(page, plot, 300, 360)
    page.locator(".series .plot[data-drawn='samples 1']").wait_for()
    plot.press("Home")
    page.locator(".series [role=status]", has_text="30 s on screen").wait_for()
    plot.press("+")
    page.locator(".series [role=status]", has_text="15 s on screen").wait_for()
    plot.press("ArrowRight")
    until(page, lambda: plot.evaluate("p => p.chart.panels[0].range.x[0]") == pytest.approx(11.25, abs=0.02))
    page.get_by_role("button", name="Whole record").press("Enter")
    # Work can be cancelled, and begun again.
    page.get_by_role("button", name=re.compile("^Characterize")).first.click()
    page.get_by_role("main").get_by_role("button", name=re.compile("^Cancel")).click()
    page.get_by_role("main").locator(".job.cancelled").wait_for()
    assert page.get_by_role("button", name=re.compile("^Characterize")).first.is_enabled()


def test_turns_are_marked_dragged_typed_and_measured(page: Any, served: tuple[str, Path]) -> None:
    """Dwells corrected by hand: what is found becomes rows; a band that is dragged, and a row that is typed, count."""
    page.get_by_role("link", name="take.parquet").click()
    plot = page.locator(SERIES)
    plot.wait_for()
    page.get_by_role("radio", name="Earth rate and north").check()
    # A stroke marks; the middle of the band moves it.
    page.get_by_role("button", name="Mark turns").press("Enter")
    page.locator(".series .plot[data-stroke=marks]").wait_for()
    stroke(page, plot, 400, 440)
    page.locator(".marks input").first.wait_for()
    values = lambda: [float(i.input_value()) for i in page.locator(".marks input").all()]  # noqa: E731
    before = values()
    assert 0 < before[0] < before[1] < 200
    left, right = band(page, plot)
    stroke(page, plot, (left + right) / 2, (left + right) / 2 + 60)
    moved = until(page, lambda: now if (now := values())[0] > before[0] + 3 else None)
    assert moved[1] - moved[0] == pytest.approx(before[1] - before[0], abs=0.05)
    _, right = band(page, plot)
    stroke(page, plot, right - 1, right + 30)  # its end alone
    longer = until(page, lambda: now if (now := values())[1] > moved[1] + 3 else None)
    assert longer[0] == pytest.approx(moved[0], abs=0.002)
    page.get_by_role("button", name="Remove turn 1").press("Enter")
    page.get_by_role("button", name="Stop marking").press("Enter")
    # Turns that show are found, taken over, corrected, and measured again.
    form = page.get_by_role("region", name="Measurement")
    form.get_by_label("Latitude [deg]").fill("-23.31")
    form.get_by_label("Model", exact=True).select_option("in words")
    form.get_by_label("Model in words").fill("N=0.001 deg/√h")
    form.get_by_label("First", exact=True).select_option("north")
    page.get_by_role("button", name="Measure").press("Enter")
    page.get_by_role("button", name="Edit the 9 detected turns").click()
    assert len(values()) == 18
    first = page.get_by_label("Stop [s] of turn 1")
    first.fill("25")
    first.press("Tab")
    page.get_by_role("button", name="Measure").press("Enter")
    measured = result_of(page, served[1], "--turns=", "main")
    assert (measured / "turns.csv").read_text().splitlines()[1].endswith(",25")
    turns = json.loads((measured / "earth-rate.json").read_text())["reversals"]["turns"]
    assert len(turns) == 9 and turns[0]["stop"] / RATE == pytest.approx(25.0, abs=0.2)
    page.locator("main .banner").first.wait_for()


def test_a_closer_look_and_its_result_among_the_results(page: Any) -> None:
    page.get_by_role("link", name="take.parquet").click()
    page.locator(SERIES).wait_for()
    page.get_by_role("radio", name="A closer look").check()
    page.get_by_role("radio", name="Spectrum").check()
    page.get_by_role("button", name="Look").click()
    page.get_by_role("group", name=re.compile("density")).and_(page.locator("[data-drawn]")).first.wait_for()
    page.get_by_role("radio", name="Filter").check()
    form = page.get_by_role("region", name="Closer look")
    form.get_by_label("Model", exact=True).select_option("in words")
    form.get_by_label("Model in words").fill("N=0.001 deg/√h")
    form.get_by_role("button", name="Look").click()
    page.get_by_text("seems to have been turned").first.wait_for()
    go(page, "#/results")
    page.get_by_role("link", name="Spectrum").first.click()
    page.locator("main .plot[data-drawn]").first.wait_for()
    assert "take.parquet" in page.locator("main h1").text_content()


def test_on_a_narrow_screen_the_name_of_the_open_recording_leads_to_it(page: Any) -> None:
    name = page.locator("#side-files a", has_text="bench.csv")
    name.click()
    page.locator("main h1").wait_for()
    page.set_viewport_size({"width": 390, "height": 844})
    for _ in range(2):  # the second time its address is the one that is open
        page.evaluate("window.scrollTo(0, 0)")
        assert page.evaluate(_TOP) > 300
        name.click()
        until(page, lambda: page.evaluate(_TOP) < 100)


_TOP = "document.getElementById('main-view').getBoundingClientRect().top"


def test_what_a_file_does_not_say_is_asked_in_its_words(page: Any, tmp_path: Path) -> None:
    """The rate alone, which its reader misses; then the counts of each sensor, where gravity tells one."""
    page.locator("#drop-input").set_input_files(imu_log(tmp_path / "bare.csv", units=False, n=400))
    page.get_by_role("alert").wait_for()
    assert "--rate" in page.get_by_role("alert").text_content()
    asked = page.get_by_role("region", name="What the file does not say")
    assert asked.locator("form > .fields input").count() == 1
    page.get_by_label("Samples per second").fill("50")
    page.get_by_role("button", name="Read the file with this").click()
    gyro = page.get_by_label(re.compile("^Gyroscope"))
    gyro.select_option(label="131 LSB/(deg/s) (±250 deg/s)")
    assert page.get_by_label(re.compile("^Accelerometer")).input_value() == "16384 LSB/g"
    assert "From gravity" in asked.text_content()
    page.get_by_role("button", name="Read the file with this").click()
    page.locator(".series .chart-name", has_text="deg/s").first.wait_for()
    assert "8 s" in page.locator("#series-title").text_content() and not asked.count()
    same = page.locator(".same code", has_text="--scale-factor=gyro=131 LSB/(deg/s),acc=16384 LSB/g")
    same.wait_for(state="attached")


def test_a_bad_file_says_what_the_command_says_and_leaves_the_list(
    page: Any, window: Any, served: tuple[str, Path]
) -> None:
    def said_by_command(name: str) -> str:
        with pytest.raises(AllaniteError) as refusal:
            al.read(served[1] / name)
        return str(refusal.value)

    row = page.locator("#side-files a", has_text="broken.parquet")
    row.click()
    alert = page.get_by_role("alert")
    alert.wait_for()
    assert alert.text_content() in said_by_command("broken.parquet")
    row.get_by_text("cannot be read").wait_for()
    page.get_by_role("button", name="Remove from the list").click()
    row.wait_for(state="detached")
    page.get_by_text("Removed from the list: 1").click()
    page.get_by_role("button", name="List again: broken.parquet").click()
    row.wait_for()
    # What does not even look like a recording is refused in the words of its reader as well, and not kept.
    (served[1] / "line.csv").write_text("time,gx\n0,1\n")
    page.locator("#drop-input").set_input_files(served[1] / "line.csv")
    notice = page.locator("#main-notice .banner span")
    notice.wait_for()
    assert notice.text_content() == said_by_command("line.csv")
    assert not list((served[1] / "allanite-dropped").iterdir())
    assert len(window[1]) == 1 and "400" in window[1].pop()  # a browser notes every refusal


def test_w9_names_of_files_and_channels_are_text(page: Any) -> None:
    page.get_by_role("link", name=EVIL).click()
    page.locator(SERIES).wait_for()
    assert page.locator("main h1").text_content() == f"{EVIL}.csv"
    assert page.locator("img").count() == 0
    asked = page.get_by_role("region", name="What the file does not say")
    assert f"{EVIL_NAME}: whole numbers from 0 to 6." in asked.text_content()
    assert f"{EVIL_NAME} [units]" in page.locator(".series .chart-name").all_text_contents()


# -- captures --------------------------------------------------------------------------------------------------------


def test_w12_a_capture_is_started_watched_through_a_reload_and_stopped(page: Any) -> None:
    page.get_by_role("link", name="Capture").click()
    page.get_by_role("button", name="Start").click()
    drawn = page.get_by_role("group", name="Series so far").and_(page.locator("[data-drawn]"))
    drawn.wait_for()
    page.reload()
    drawn.wait_for()  # all that has come meanwhile
    samples = page.locator(".facts div", has_text="Samples").locator("dd")
    until(page, lambda: int(re.sub(r"\D", "", samples.text_content() or "0") or 0) > 0)
    page.get_by_role("button", name="Stop").click()
    page.get_by_text("Stopped. What was recorded is kept.").wait_for()
    assert page.get_by_role("button", name="Stop").count() == 0


def test_a_port_is_chosen_by_its_title_and_sent_by_its_id(page: Any) -> None:
    go(page, "#/capture")
    at_rest(page)
    page.get_by_label("Instrument", exact=True).select_option("IMU on a serial port")
    port, frames = page.get_by_label("Port", exact=True), page.get_by_label("Format", exact=True)
    assert port.locator("option").all_text_contents()[:2] == [BENCH.title, TABLE.title]
    port.select_option(TABLE.title)
    assert frames.is_disabled()  # its description came with it
    port.select_option(BENCH.title)
    assert frames.locator("option").all_text_contents() == ["x1.yaml"]
    with page.expect_request(lambda r: r.method == "POST" and r.url.endswith("/api/captures")) as sent:
        page.get_by_role("button", name="Start").click()
    assert sent.value.post_data_json["options"]["port"] == BENCH.id
    page.get_by_text("/dev/null cannot be opened").first.wait_for()  # the recorder was started, and says so
    page.get_by_text("allanite record serial --port=/dev/null --format=x1.yaml").wait_for(state="attached")


def test_sliders_plan(page: Any) -> None:
    go(page, "#/plan")
    amount = page.locator(".amount")
    amount.wait_for()
    before = float(amount.text_content().split()[0])
    page.get_by_role("slider", name="Length of the record").press("End")
    after = until(
        page, lambda: now if (now := float(amount.text_content().split()[0])) < before / 3 else None
    )
    assert 0 < after < before / 3


# -- for everybody ---------------------------------------------------------------------------------------------------


def all_views(page: Any) -> Iterator[str]:
    """Every view, with all that is folded away opened."""
    for address in VIEWS:
        go(page, address)
        if address == "#/plan":
            page.locator(".plot[data-drawn]").wait_for()
        yield opened(page, address)
    go(page, "#/results")
    page.get_by_role("link", name="Calibration").click()
    page.locator("main [data-drawn=yes]").first.wait_for()
    page.get_by_role("heading", name="For other programs").wait_for()
    yield opened(page, "result")
    go(page, "#/")
    studied(page)
    page.locator(SERIES).wait_for()
    yield opened(page, "study")
    page.get_by_role("radio", name="A closer look").check()
    yield opened(page, "closer")
    page.get_by_role("radio", name="Earth rate and north").check()
    page.get_by_role("button", name="Add a turn").click()
    yield opened(page, "measure")


def opened(page: Any, name: str) -> str:
    at_rest(page)
    page.locator("main details:not([open])").evaluate_all("all => all.forEach((d) => (d.open = true))")
    return name


_REACH = """
() => {
  const shown = (e) => e.getClientRects().length && !e.disabled && getComputedStyle(e).visibility !== "hidden";
  const all = [...document.querySelectorAll("a[href], button, select, input, summary, [tabindex='0']")].filter(shown);
  // Of radio buttons of one name the tabulator reaches the chosen one; arrows do the rest.
  const wanted = all.filter((e) => e.type !== "radio" || e.checked);
  const outlined = (x) => x && getComputedStyle(x).outlineStyle !== "none";
  window.reached = new Map(wanted.map((e) => [e, null]));
  window.focused = (event) => {
    const e = event.target, labels = [...(e.labels || [])].map((l) => l.textContent.trim()).join();
    const name = e.getAttribute("aria-label") || e.textContent.trim() || labels;
    const well = [e, e.nextElementSibling, e.previousElementSibling].some(outlined) && name;
    if (window.reached.has(e)) window.reached.set(e, well);
  };
  addEventListener("focusin", window.focused);
  document.activeElement.blur();
  getSelection().collapse(document.body, 0);
  return wanted.length;
}
"""
_CUT = """
() => {
  const wide = document.documentElement.scrollWidth > innerWidth ? ["the page"] : [];
  const hints = (e) => getComputedStyle(e).backgroundImage.split("gradient").length > 4;
  const cut = [...document.querySelectorAll("main *, aside *, header *")].filter((e) =>
    e.clientWidth > 1 && e.scrollWidth > e.clientWidth + 1
    && getComputedStyle(e).overflowX !== "visible" && !e.closest("svg, select, input, .hidden") && !hints(e));
  return [...wide, ...cut.map((e) => e.outerHTML.slice(0, 160))];
}
"""
_MISSED = """
() => {
  removeEventListener("focusin", window.focused);
  return [...window.reached].filter(([, well]) => !well).map(([e, well]) => [well, e.outerHTML.slice(0, 160)]);
}
"""


def test_every_view_is_operated_by_keyboard_and_passes_axe_in_light_and_dark(page: Any) -> None:
    """Every control is reached, shows it and has a name; WCAG 2.2 as far as a program can tell, contrast among it."""
    axe = axe_script()
    if axe:
        page.evaluate(axe)
    for view in all_views(page):
        count = page.evaluate(_REACH)
        for number in range(2 * count + 20):  # what scrolls is reached as well
            page.keyboard.press("Tab")
            if number >= count and page.evaluate("[...window.reached.values()].every(Boolean)"):
                break
        assert page.evaluate(_MISSED) == [], view  # not reached, or neither outlined nor named
        ids = page.locator("[id]").evaluate_all("all => all.map((e) => e.id)")
        assert len(set(ids)) == len(ids), view
        # What happens is said to those who do not see it.
        assert page.locator("[role=status], [aria-live=polite], [role=alert]").count(), view
        if axe:
            assert violations(page) == [], view
        page.set_viewport_size({"width": 390, "height": 844})
        until(page, lambda: page.evaluate(_CUT) == [])
        page.set_viewport_size({"width": 1280, "height": 800})
    if not axe:
        pytest.skip("axe is not installed: pip install axe-playwright-python; all else was checked")


@pytest.mark.long
def test_w11_nothing_but_this_machine_can_be_asked(page: Any, window: Any) -> None:
    """That nobody tried is looked at in every test: the window by `page`, the server by `served`."""
    policy = page.evaluate("fetch('/').then((r) => r.headers.get('content-security-policy'))")
    assert "default-src 'none'" in policy and "connect-src 'self'" in policy and "http" not in policy
    left = page.evaluate("fetch('http://example.org/').then(() => 'reached', () => 'refused')")
    assert left == "refused"
    until(page, lambda: window[1])
    assert all("violates the" in said for said in window[1])
    window[1].clear()
