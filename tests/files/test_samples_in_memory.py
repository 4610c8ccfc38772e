# SPDX-License-Identifier: BSD-3-Clause
"""Samples in memory are read as a file of them would be: the same grid, gaps, units and findings."""

from __future__ import annotations

import io
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite import InputError, Recording

pa = pytest.importorskip("pyarrow")

NAMES = ("gyro_x", "gyro_y", "gyro_z")
UNIT = "deg/s"
START = 1_735_787_045_000_000_000
ROWS = np.delete(np.arange(4000), slice(700, 760))
NANOSECONDS = ROWS * 10_000_000
SECONDS = ROWS / 100
MOMENTS = np.datetime64(START, "ns") + NANOSECONDS.astype("timedelta64[ns]")
SAMPLES = np.random.default_rng(28).normal(size=(len(ROWS), 3)).round(6)
SAMPLES[1234] = np.nan
SAMPLES[2000:2040] = SAMPLES[2000]

#: Findings on how columns were taken, not on their samples.
OF_COLUMNS = ("cells_missing", "dialect_guessed", "no_time_stamps")

Make = Callable[[], Recording]


def _columns() -> dict[str, Any]:
    return dict(zip(NAMES, SAMPLES.T, strict=True))


@pytest.fixture(scope="module")
def of_file(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    lines = ["time [s]," + ",".join(NAMES)]
    lines += [
        f"{t!r},{','.join(map(repr, row))}" for t, row in zip(SECONDS.tolist(), SAMPLES.tolist(), strict=True)
    ]
    path = tmp_path_factory.mktemp("log") / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    return al.read(path, unit=UNIT)


def _of(data: Any, **more: Any) -> Recording:
    return Recording.from_samples(data, **{"unit": UNIT, **more})


def _pandas(**index: Any) -> Any:
    pd = pytest.importorskip("pandas")
    return pd.DataFrame(_columns(), **index)


def _at(zone: str | None = None) -> Any:
    index = pytest.importorskip("pandas").DatetimeIndex(MOMENTS)
    return index if zone is None else index.tz_localize("UTC").tz_convert(zone)


def _polars(**columns: Any) -> Any:
    return pytest.importorskip("polars").DataFrame({**columns, **_columns()})


def _xarray() -> Any:
    xr = pytest.importorskip("xarray")
    return xr.DataArray(
        SAMPLES, dims=("time", "axis"), coords={"time": MOMENTS, "axis": list(NAMES)}, attrs={"units": UNIT}
    )


def _structured() -> Any:
    return np.rec.fromarrays([SECONDS, *SAMPLES.T], names=",".join(("t", *NAMES)))


def _arrow_with_units() -> Any:
    fields = [pa.field(name, pa.float64(), metadata={"unit": UNIT}) for name in NAMES]
    return pa.table([SECONDS, *SAMPLES.T], schema=pa.schema([("t", pa.float64()), *fields]))


MADE: dict[str, Make] = {
    "array, seconds": lambda: _of(SAMPLES, time=SECONDS, names=NAMES),
    "array, ns": lambda: _of(SAMPLES, time=NANOSECONDS, time_unit="ns", names=NAMES),
    "array, ms": lambda: _of(SAMPLES, time=ROWS * 10.0, time_unit="ms", names=NAMES),
    "array, ns since 1970": lambda: _of(SAMPLES, time=START + NANOSECONDS, time_unit="ns", names=NAMES),
    "array, moments": lambda: _of(SAMPLES, time=MOMENTS, names=NAMES),
    "array, moments in ms": lambda: _of(SAMPLES, time=MOMENTS.astype("datetime64[ms]"), names=NAMES),
    "array, durations": lambda: _of(SAMPLES, time=MOMENTS - MOMENTS[0], names=NAMES),
    "list, datetimes": lambda: _of(
        SAMPLES.tolist(),
        time=[
            datetime.fromtimestamp(START // 10**9, UTC) + timedelta(milliseconds=10 * k)
            for k in ROWS.tolist()
        ],
        names=NAMES,
    ),
    "masked array": lambda: _of(np.ma.masked_invalid(SAMPLES), time=SECONDS, names=NAMES),
    "other byte order": lambda: _of(SAMPLES.astype(">f8"), time=SECONDS, names=NAMES),
    "mapping with time": lambda: _of({"t": SECONDS, **_columns()}),
    "mapping, time stated": lambda: _of({"clock": ROWS * 10, **_columns()}, time="clock:ms"),
    "mapping of a matrix": lambda: _of({"time": MOMENTS, "gyro": SAMPLES}),
    "structured array": lambda: _of(_structured()),
    "Arrow": lambda: _of(pa.table({"t": SECONDS, **_columns()})),
    "Arrow with units": lambda: Recording.from_samples(_arrow_with_units()),
    "Arrow stream": lambda: _of(pa.table({"t": SECONDS, **_columns()}).to_reader(1000)),
    "pandas, column": lambda: _of(_pandas().assign(t=SECONDS, note="at rest")),
    "pandas, index of moments": lambda: _of(_pandas(index=_at())),
    "pandas, index in a zone": lambda: _of(_pandas(index=_at("Europe/Berlin"))),
    "pandas, index of durations": lambda: _of(_pandas(index=_at() - _at()[0])),
    "pandas, index of seconds": lambda: _of(_pandas(index=SECONDS)),
    "pandas, rows left out": lambda: _of(_pandas(index=ROWS), rate=100.0),
    "pandas, time apart": lambda: _of(_pandas(), time=_at("Asia/Tokyo")),
    "pandas, missing values": lambda: _of(_pandas(index=_at()).convert_dtypes()),
    "polars, seconds": lambda: _of(_polars(t=SECONDS)),
    "polars, moments": lambda: _of(_polars(when=MOMENTS)),
    "polars, time apart": lambda: _of(_polars(), time=pytest.importorskip("polars").Series("t", MOMENTS)),
    "xarray DataArray": lambda: Recording.from_samples(_xarray()),
    "xarray Dataset": lambda: Recording.from_samples(_xarray().to_dataset(dim="axis")),
}


@pytest.mark.long
@pytest.mark.parametrize("make", MADE.values(), ids=MADE)
def test_samples_are_read_as_a_file_of_them(make: Make, of_file: Recording) -> None:
    made = make()
    assert made.names == of_file.names
    assert made.channels == of_file.channels
    assert (made.rate, made.n_samples) == (of_file.rate, of_file.n_samples)
    assert made.source == ""
    for name in NAMES:
        np.testing.assert_array_equal(made.values(name), of_file.values(name))
    found, expected = ({(f.code, f.channel) for f in al.check(one)} for one in (made, of_file))
    assert {one for one in found if one[0] not in OF_COLUMNS} == {
        one for one in expected if one[0] not in OF_COLUMNS
    }


@pytest.mark.parametrize(
    "make",
    [make for name, make in MADE.items() if any(w in name for w in ("moments", "zone", "1970", "xarray"))],
)
def test_moments_give_the_start(make: Make) -> None:
    assert make().start == START


def test_samples_stay_where_they_are() -> None:
    samples = SAMPLES.copy()
    column = Recording.from_samples(samples, rate=100.0, unit=UNIT, names=NAMES).columns[0]
    assert np.shares_memory(column.read(0, 10), samples)


@pytest.mark.parametrize("kind", ["pandas", "polars"])
def test_a_series_is_one_channel(kind: str) -> None:
    library = pytest.importorskip(kind)
    series = library.Series(SAMPLES[:, 0]) if kind == "pandas" else library.Series("signal", SAMPLES[:, 0])
    recording = _of(series, rate=100.0)
    assert recording.names == ("signal",)
    np.testing.assert_array_equal(recording.values("signal"), SAMPLES[:, 0])


@pytest.mark.parametrize(("key", "value", "counts"), [("scale_factor", 0.004, 250), ("gain", 131.0, 131)])
def test_integers_of_xarray_with_a_scaling_that_nobody_applied_are_counts(
    key: str, value: float, counts: int
) -> None:
    """As `open_dataset(mask_and_scale=False)` leaves them, and as loggers word it."""
    xr = pytest.importorskip("xarray")
    raw = np.arange(-500, 500, dtype=np.int16)
    gyro = xr.DataArray(raw, dims="time", name="gyro", attrs={"units": "deg/s", key: value})
    recording = Recording.from_samples(gyro, rate=100.0)
    assert recording["gyro"].unit == "LSB"
    (said,) = [note for note in recording.notes["source"]["guesses"] if "not applied" in note]
    factor = said.partition('--scale-factor "')[2].rstrip('"')
    scaled = Recording.from_samples(gyro, rate=100.0, scale_factor=factor)
    assert np.allclose(scaled.scaled("gyro"), np.radians(raw / counts))
    fine = Recording.from_samples(gyro.astype(float), rate=100.0)
    assert fine["gyro"].unit == "deg/s"


def test_units_of_attributes_are_kept_apart() -> None:
    xr = pytest.importorskip("xarray")
    dataset = xr.Dataset(
        {"gx": ("t", SAMPLES[:, 0], {"units": UNIT}), "temp": ("t", SAMPLES[:, 1], {"units": "degC"})},
        coords={"t": ("t", SECONDS * 1e3, {"units": "ms"})},
    )
    recording = Recording.from_samples(dataset)
    assert [c.unit for c in recording.channels] == [UNIT, "degC"]
    assert recording.rate == 100.0


def test_units_of_samples_are_not_those_of_time() -> None:
    xr = pytest.importorskip("xarray")
    data = xr.DataArray(SAMPLES[:, 0], dims="t", coords={"t": SECONDS}, attrs={"units": UNIT}, name="gx")
    recording = Recording.from_samples(data)
    assert (recording.rate, recording["gx"].unit) == (100.0, UNIT)


def test_what_is_left_out_is_said() -> None:
    recording = _of(_pandas().assign(t=SECONDS, note="at rest"))
    assert "columns without numbers left out: note" in recording.notes["source"]["guesses"]


REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "whole numbers without a unit": (lambda: _of(SAMPLES, time=NANOSECONDS), "time_unit='ns'"),
    "an unknown unit": (lambda: _of(SAMPLES, time=NANOSECONDS, time_unit="fortnight"), "fortnight"),
    "a unit twice": (lambda: _of(SAMPLES, time=MOMENTS, time_unit="ns"), "which has a unit"),
    "a unit of a column": (lambda: _of({"t": ROWS, **_columns()}, time="t", time_unit="ms"), "time='t:ms'"),
    "stamps of another length": (lambda: _of(SAMPLES, time=SECONDS[1:]), "3939 stamps"),
    "stamps of two dimensions": (lambda: _of(SAMPLES, time=SAMPLES), "shape"),
    "stamps of words": (lambda: _of(SAMPLES, time=["now"] * len(ROWS)), "time= needs a column"),
    "objects": (lambda: _of([{"t": 1}]), "neither numbers nor dates"),
    "nothing": (lambda: _of(None), "NoneType"),
    "a path": (lambda: _of("log.csv"), "al.read"),
    "an open file": (lambda: _of(io.BytesIO(b"1")), "al.read"),
    "no rate": (lambda: _of(SAMPLES), "rate=RATE"),
    "names of others": (lambda: _of(SAMPLES, time=SECONDS, names=["gyro"]), "1 names for 3 columns"),
    "rows not computed": (lambda: _of(_polars(t=SECONDS).lazy()), r"data\.collect"),
    "columns of one name": (
        lambda: _of(_pandas().set_axis(["a", "a", "b"], axis=1), rate=1.0),
        "(?i)duplicate",
    ),
    "several dimensions": (
        lambda: Recording.from_samples(_xarray().expand_dims(unit=2).to_dataset(name="gyro")),
        "isel",
    ),
    "units in a list": (lambda: Recording.from_samples(SAMPLES, rate=1.0, unit=[UNIT] * 3), "unit must be"),  # type: ignore[arg-type]
    "a unit in bytes": (lambda: Recording.from_samples(SAMPLES, rate=1.0, unit=b"g"), "unit must be"),  # type: ignore[arg-type]
    "no unit of one": (lambda: Recording.from_samples(SAMPLES, rate=1.0, unit={"x": None}), "unit must be"),  # type: ignore[dict-item]
    "a number as scale factor": (lambda: _of(SAMPLES, rate=1.0, scale_factor=131.0), "scale_factor must be"),
    "channels by number": (lambda: _of(SAMPLES, rate=1.0, channels=[0, 2]), "channels must be names"),
    "a channel by number": (lambda: _of(SAMPLES, rate=1.0, channels=0), "channels must be names"),
    "time by number": (lambda: _of(SAMPLES, time=0), "time= needs a column"),
    "a start in words": (lambda: _of(SAMPLES, rate=1.0, start="a"), "start must be seconds"),
    "an end as a moment": (lambda: _of(SAMPLES, rate=1.0, stop=MOMENTS[0]), "stop must be seconds"),
    "names beside those of a frame": (lambda: _of(_pandas(), names=NAMES), "rename them there"),
    "names beside those of a mapping": (lambda: _of(_columns(), rate=1.0, names=NAMES), "rename them there"),
    "a carrier alone": (lambda: _of(SAMPLES, rate=1.0, carrier=1e7), "kind="),
    "read of a frame": (lambda: al.read(_pandas()), "from_samples"),  # type: ignore[arg-type]
    "read of a mapping": (lambda: al.read(_columns()), "from_samples"),  # type: ignore[arg-type]
    "read with time by number": (lambda: al.read(__file__, time=0), "time must name a column"),  # type: ignore[arg-type]
    "read of bytes": (lambda: al.read(io.BytesIO(b"1,2")), "write_bytes"),  # type: ignore[arg-type]
}


@pytest.mark.parametrize(("call", "words"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_read_is_said(call: Callable[[], object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        call()
