# SPDX-License-Identifier: BSD-3-Clause
"""Series of any length: every block against plain NumPy, gaps, exact samples, runs that grow; what the page answers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from allanite.commands.page.envelope import GrowingEnvelope
from allanite.commands.page.pyramid import FACTOR, SeriesPyramid, build
from allanite.errors import FormatError, InputError
from allanite.files.readers import read
from allanite.recording.records import ArrayColumn, Channel, Recording
from page_client import Browser, application

RATE = 100.0


def recording_of(samples: np.ndarray, **options: object) -> Recording:
    return Recording.from_rate(samples, rate=RATE, unit="deg/s", **options)  # type: ignore[arg-type]


def built(samples: np.ndarray, folder: Path) -> SeriesPyramid:
    folder.mkdir(exist_ok=True)
    build(recording_of(samples), folder)
    return SeriesPyramid(folder)


def must_agree(pyramid: SeriesPyramid, x: np.ndarray, start: float, stop: float | None, blocks: int) -> str:
    """Every block of a window has the ends of its samples; NumPy says which."""
    w = pyramid.window([0], start, stop, blocks=blocks)
    (found,) = w.values
    if w.kind == "samples":
        np.testing.assert_array_equal(found[0], x[w.first : w.first + w.count])
        return w.kind
    assert w.count <= blocks + 2 and w.first % w.size == 0
    assert w.first <= max(start * RATE, 0)
    assert w.first + w.count * w.size >= min(len(x), np.inf if stop is None else stop * RATE)
    part = x[w.first : w.first + w.count * w.size]
    padded = np.full(w.count * w.size, np.nan)
    padded[: len(part)] = part
    rows = padded.reshape(w.count, w.size)
    empty = np.isnan(rows).all(axis=1)
    low, high = (
        np.where(np.isnan(rows), np.inf, rows).min(axis=1),
        np.where(np.isnan(rows), -np.inf, rows).max(axis=1),
    )
    np.testing.assert_array_equal(found[0], np.where(empty, np.nan, low))
    np.testing.assert_array_equal(found[1], np.where(empty, np.nan, high))
    return w.kind


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> tuple[SeriesPyramid, np.ndarray]:
    rng = np.random.default_rng(7)
    x = rng.standard_normal(
        FACTOR**5 + 12_345
    )  # blocks of the fifth level are longer than what is read at a time
    x[:17] = np.nan
    x[300_000:420_000] = np.nan
    x[rng.integers(0, x.size, 500)] = np.nan
    x[-1] = np.nan
    return built(x, tmp_path_factory.mktemp("long")), x


def test_whole_record_and_its_facts(long: tuple[SeriesPyramid, np.ndarray]) -> None:
    pyramid, x = long
    assert must_agree(pyramid, x, 0.0, None, 1500) == "blocks"
    (channel,) = pyramid.facts["channels"]
    assert channel["missing"] == np.count_nonzero(np.isnan(x))
    assert (channel["low"], channel["high"]) == (np.nanmin(x), np.nanmax(x))
    spans = np.flatnonzero(np.diff(np.concatenate([[0], np.isnan(x).astype(np.int8), [0]]))).reshape(-1, 2)
    assert channel["gaps"] == spans[:1000].tolist()


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    start=st.floats(-50, 11_000),
    length=st.floats(0.001, 11_000),
    blocks=st.sampled_from([1, 7, 100, 1500, 4000]),
)
def test_any_window_is_exact(
    long: tuple[SeriesPyramid, np.ndarray], start: float, length: float, blocks: int
) -> None:
    pyramid, x = long
    must_agree(pyramid, x, start, start + length, blocks)


@pytest.mark.parametrize("n", [1, 2, 15, 16, 17, 3000, 3001, 4096, 4097, 65_535, 65_536, 65_537])
def test_any_length_is_exact(tmp_path: Path, n: int) -> None:
    x = np.random.default_rng(n).standard_normal(n)
    x[n // 2] = np.nan
    pyramid = built(x, tmp_path)
    kinds = {must_agree(pyramid, x, a * n / RATE, b * n / RATE, k)
             for a, b in ((0, 1), (0.3, 0.9)) for k in (1, 10, 1500)}  # fmt: skip
    assert kinds == ({"samples"} if n <= 2 else kinds)


def test_blocks_stay_the_same_while_a_picture_is_moved(long: tuple[SeriesPyramid, np.ndarray]) -> None:
    pyramid, _ = long
    one = pyramid.window([0], 1000.0, 4000.0, blocks=500)
    other = pyramid.window([0], 1100.0, 4100.0, blocks=500)
    assert one.size == other.size and one.first % one.size == other.first % other.size == 0
    shift = (other.first - one.first) // one.size
    np.testing.assert_array_equal(
        one.values[0][:, shift : one.count], other.values[0][:, : one.count - shift]
    )


def test_samples_keep_their_values(tmp_path: Path) -> None:
    """Integers of 64 bits far from zero, float32 and overload words."""
    names = ("big", "small", "counts", "word")
    columns = (
        np.arange(10_000, dtype=np.int64) + 2**40,
        np.random.default_rng(1).standard_normal(10_000).astype(np.float32),
        np.arange(10_000, dtype=np.int16) - 5000,
        np.where(np.arange(10_000) == 77, 9.9e37, 1.5),
    )
    recording = Recording(
        channels=tuple(Channel.of(n, "LSB") for n in names),
        columns=tuple(map(ArrayColumn, columns)),
        rate=RATE,
    )
    build(recording, tmp_path)
    pyramid = SeriesPyramid(tmp_path)
    found = pyramid.window([0, 1, 2, 3], 0.0, 10.0).values
    for values, column in zip(found, columns[:3], strict=False):
        np.testing.assert_array_equal(values[0], column[:1000])
    assert np.isnan(found[3][0][77]) and np.count_nonzero(np.isnan(found[3][0])) == 1
    assert (tmp_path / "1-0.npy").stat().st_size < 41_000 < (tmp_path / "0-0.npy").stat().st_size
    assert not np.load(tmp_path / "0-0.npy", mmap_mode="r").flags.writeable


def test_refusals(long: tuple[SeriesPyramid, np.ndarray], tmp_path: Path) -> None:
    pyramid, _ = long
    for bad in ({"channels": [1]}, {"channels": [-1]}, {"start": 5.0, "stop": 5.0}, {"start": float("nan")},
                {"blocks": 0}, {"blocks": 10**6}):  # fmt: skip
        with pytest.raises(InputError):
            pyramid.window(**{"channels": [0], **bad})  # type: ignore[arg-type]
    with pytest.raises(FormatError, match="no prepared series"):
        SeriesPyramid(tmp_path)
    beyond = pyramid.window([0], 1e6, 2e6)
    assert beyond.count == 0


def test_envelope_of_a_run_that_grows() -> None:
    rng = np.random.default_rng(3)
    counter = np.cumsum(rng.integers(1, 4, 5000)) + 100
    values = rng.standard_normal((5000, 2))
    values[17, 0] = np.nan
    envelope = GrowingEnvelope(2, 10.0, most=64)
    for part in np.array_split(np.arange(5000), 37):
        envelope.add(counter[part], values[part])
    assert 32 < envelope.count <= 64
    blocks = (counter - counter[0]) // envelope.size
    for block in range(envelope.count):
        inside = values[blocks == block]
        np.testing.assert_array_equal(envelope.low[:, block], np.nanmin(inside, axis=0))
        np.testing.assert_array_equal(envelope.high[:, block], np.nanmax(inside, axis=0))
    plain = envelope.to_json()
    assert plain["first"] == counter[0] and len(plain["low"]) == 2 and json.dumps(plain, allow_nan=False)
    late = GrowingEnvelope(1, 10.0, most=4)
    late.add(np.array([0, 1000]), np.array([[1.0], [2.0]]))  # a long gap
    assert late.to_json()["low"][0].count(None) == late.count - 2 == 0 or late.to_json()["low"][0][1] is None


# -- what the page answers ------------------------------------------------------------------------------------


def test_page_opens_a_recording_and_answers_windows(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    x = np.random.default_rng(5).standard_normal((20_000, 2))
    x[500:700, 1] = np.nan
    np.save(tmp_path / "data" / "log.npy", x)
    with Browser(application(tmp_path / "data", tmp_path / "cache", workers=1)) as browser:
        key = browser.recording("log.npy")
        how = {"read": {"unit": "deg/s", "rate": 100}}
        first = browser.post(f"/api/recordings/{key}/open", how)
        assert first.status_code == 202
        assert browser.wait(first.json()["job"])["state"] == "done"
        opened = browser.post(f"/api/recordings/{key}/open", how)
        assert opened.status_code == 200 and opened.json()["ready"]
        meta = opened.json()["series"]
        assert meta["samples"] == 20_000 and meta["gaps"]["1"] == [[5.0, 7.0]] and meta["gaps"]["0"] == []
        assert [c["shown_unit"] for c in meta["channels"]] == ["deg/s", "deg/s"]
        assert browser.get("/api/catalogue").json()["recordings"][0]["facts"]["duration"] == 200.0
        # exact samples, the same as those of the library
        answer = browser.get(f"/api/series/{meta['id']}/window", params={"channels": "1", "from": 4, "to": 8})
        said = json.loads(answer.headers["x-series"])
        library = read(tmp_path / "data" / "log.npy", unit="deg/s", rate=100.0)
        np.testing.assert_array_equal(
            np.frombuffer(answer.content, "<f8"),
            library.values(library.names[1])[said["first"] :][: said["count"]],
        )
        # blocks of both channels, in half the bytes
        answer = browser.get(f"/api/series/{meta['id']}/window", params={"blocks": 100, "type": "f4"})
        said = json.loads(answer.headers["x-series"])
        blocks = np.frombuffer(answer.content, "<f4").reshape(2, 2, said["count"])
        assert (said["kind"], said["size"], said["count"]) == ("blocks", 208, 97)
        assert blocks[0, 1].max() == np.float32(x[:, 0].max())
        assert np.isnan(blocks[1, 0, 3]) == np.isnan(x[624:832, 1]).all()
        for bad in ("channels=x", "channels=7", "from=b", "type=i4", "from=5&to=1", "blocks=0"):
            assert browser.get(f"/api/series/{meta['id']}/window?{bad}").status_code == 400
        assert (
            browser.post(f"/api/recordings/{key}/open", {"read": {"layout": "/etc/passwd"}}).status_code
            == 400
        )
        # another unit is another series; without a rate it cannot be read, and the job says why
        failed = browser.wait(browser.post(f"/api/recordings/{key}/open", {}).json()["job"])
        assert failed["state"] == "failed" and "rate" in failed["message"]
        assert browser.get(f"/api/series/{meta['id']}").json()["read"] == {"unit": "deg/s", "rate": 100.0}
