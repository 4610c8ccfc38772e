# SPDX-License-Identifier: BSD-3-Clause
"""Every result is a table for pandas, polars and Arrow, a cell of a notebook, and equal to what it was read from."""

from __future__ import annotations

import json
import math
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite import InputError
from allanite.quantities.tabular import Tabular
from allanite.views.registry import VIEWS, document_of

pa = pytest.importorskip("pyarrow")

_OF_A_KIND = 4  # documents of each kind that are looked at, spread over those that there are


def _documents() -> list[Path]:
    kinds: dict[str, list[Path]] = {}
    for path in sorted(Path(__file__).parents[1].glob("*/documents/*.json")):
        kinds.setdefault(json.loads(path.read_text(encoding="utf-8")).get("format", ""), []).append(path)
    paths = [kinds[kind] for kind in VIEWS if kind in kinds]
    return [path for of_kind in paths for path in of_kind[:: -(-len(of_kind) // _OF_A_KIND)]]


DOCUMENTS = _documents()


def result_of(path: Path) -> Any:
    return document_of(json.loads(path.read_text(encoding="utf-8"))).result


@pytest.fixture(scope="module")
def recording() -> al.Recording:
    rng = np.random.default_rng(29)
    samples = rng.normal(size=(20_000, 2)) * 0.01
    samples[5000:5100] = np.nan
    start = 1_735_787_045_000_000_000
    return al.Recording.from_rate(samples, rate=100.0, unit="deg/s", names=["gyro_x", "gyro_y"], start=start)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_every_result_is_a_table(path: Path) -> None:
    pd, pl = pytest.importorskip("pandas"), pytest.importorskip("polars")
    result = result_of(path)
    columns = result.to_columns()
    (length,) = {len(column) for column in columns.values()}
    frame = result.to_frame()
    assert isinstance(frame, pd.DataFrame) and frame.shape == (length, len(columns))
    assert pl.DataFrame(result).shape == frame.shape
    assert pa.table(result).column_names == list(columns)
    html = result._repr_html_()
    assert html.count("<tr>") == min(length, 20) + 1 and all(f"<th>{name}</th>" in html for name in columns)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_every_number_with_an_interval_is_in_the_table(path: Path) -> None:
    result = result_of(path)
    columns = result.to_columns()
    if "name" not in columns:
        pytest.skip("a table of its own")
    listed = {key: [v for v in columns[key] if not math.isnan(v)] for key in ("value", "lower", "upper")}
    for number in numbers_of(result.to_json()):
        for key, values in listed.items():
            if number[key] is not None:
                assert any(value == pytest.approx(number[key], rel=1e-12) for value in values), number


def numbers_of(document: object) -> Any:
    """The numbers with intervals in plain data; an alternative family is left to its model."""
    if isinstance(document, dict):
        ends = [document.get(key, "") for key in ("value", "lower", "upper")]
        if all(one is None or isinstance(one, (int, float)) for one in ends):
            yield document
        for key, inner in document.items():
            if key != "alternative":
                yield from numbers_of(inner)
    elif isinstance(document, list):
        for inner in document:
            yield from numbers_of(inner)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_a_result_is_shown_in_few_words(path: Path) -> None:
    shown = repr(result_of(path))
    assert len(shown) < 2500 and "array(" not in shown and "\n" not in shown


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_results_with_arrays_are_compared(path: Path) -> None:
    one, other = result_of(path), result_of(path)
    assert one == other
    for name, array in arrays_of(one):
        changed = np.array(array)
        changed.flat[0] += 1.0 if changed.dtype.kind == "f" else 1
        if np.isfinite(changed.flat[0]):
            assert replace(one, **{name: changed}) != other


def arrays_of(result: Any) -> list[tuple[str, Any]]:
    pairs = [(f.name, getattr(result, f.name)) for f in fields(result)]
    return [(k, v) for k, v in pairs if isinstance(v, np.ndarray) and v.size and v.dtype.kind in "if"]


def test_curves_are_compared_with_their_missing_numbers(recording: al.Recording) -> None:
    curve, again = al.allan_curve(recording), al.allan_curve(recording)
    assert curve == again
    assert curve != replace(curve, deviation=curve.deviation * (1 + 1e-12))
    hole = np.where(np.arange(len(curve.tau))[:, None] == 2, np.nan, curve.deviation)
    assert replace(curve, deviation=hole) == replace(again, deviation=hole.copy())


def test_a_curve_is_a_table_of_channels_and_lags(recording: al.Recording) -> None:
    curve = al.allan_curve(recording)
    frame = curve.to_frame()
    for i, name in enumerate(curve.names):
        rows = frame[frame.channel == name]
        np.testing.assert_array_equal(rows.tau, curve.tau)
        np.testing.assert_array_equal(rows.deviation, curve.deviation[:, i])
        np.testing.assert_array_equal(rows["count"], curve.count[:, i])
    assert set(frame.unit) == {"rad/s"}
    assert repr(curve).startswith("<AllanCurve oadev of gyro_x, gyro_y:")


@pytest.mark.long
def test_a_study_is_a_table_of_its_coefficients(recording: al.Recording) -> None:
    study = al.characterize(recording)
    frame = study.to_frame()
    white = frame[(frame.channel == "gyro_x") & (frame.term == "N")].iloc[0]
    (estimate,) = [e for e in study.models["gyro_x"].estimates if e.symbol == "N"]
    assert (white.value, white.lower, white.upper) == (estimate.value, estimate.lower, estimate.upper)
    assert (white.unit, white.status) == ("rad/s/√Hz", "resolved")


def test_a_recording_goes_out_and_comes_back(recording: al.Recording) -> None:
    back = {
        "frame": al.Recording.from_samples(recording.to_frame(), unit="deg/s"),
        "Arrow": al.Recording.from_samples(recording),
    }
    for made in back.values():
        assert (made.channels, made.rate, made.start) == (recording.channels, recording.rate, recording.start)
        for name in recording.names:
            np.testing.assert_array_equal(made.values(name), recording.values(name))


@pytest.mark.parametrize("of", ["curve", "recording", "study"])
def test_a_result_is_no_array(of: str, recording: al.Recording) -> None:
    result: Tabular = recording
    if of != "recording":
        result = al.allan_curve(recording) if of == "curve" else al.characterize(recording)
    with pytest.raises(InputError, match="to_columns"):
        np.asarray(result)


def test_text_is_escaped(recording: al.Recording) -> None:
    named = al.Recording.from_rate(recording.values("gyro_x"), rate=1.0, unit="V", names="<b>&")
    html = al.allan_curve(named)._repr_html_()
    assert "&lt;b&gt;&amp;" in html and "<b>" not in html


def test_a_frame_needs_a_library(recording: al.Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr("allanite.quantities.tabular.import_module", absent)
    with pytest.raises(InputError, match="pip install pandas"):
        recording.to_frame()
