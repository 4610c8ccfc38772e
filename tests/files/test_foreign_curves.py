# SPDX-License-Identifier: BSD-3-Clause
"""Allan curves of other programs: any table comes back to the same numbers, and what is not known is asked for."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import allanite as al
from allanite.errors import AllaniteError, DataQualityError, FormatError, InputError
from allanite.files.foreign_curves import read_curve
from allanite.files.readers.curve_shape import grows_geometrically
from shell import Run

N, RATE = 4000, 50.0
LAGS = np.array([1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024])


@cache
def twin(channel: int = 0) -> NDArray[np.float64]:
    """The overlapping Allan deviation as a textbook writes it (SP 1065, equation 11), in deg/s."""
    y = (
        np.random.default_rng(channel).standard_normal(N)
        + 0.01 * np.random.default_rng(9).standard_normal(N).cumsum()
    )
    x = np.concatenate(([0.0], np.cumsum(y))) / RATE
    tau = LAGS / RATE
    return np.array(
        [
            np.sqrt(np.mean((x[2 * m :] - 2 * x[m:-m] + x[: -2 * m]) ** 2) / 2) / t
            for m, t in zip(LAGS, tau, strict=True)
        ]
    )


TIMES = {"tau": 1.0, "tau (s)": 1.0, "Averaging time [s]": 1.0, "taus": 1.0, "tau_ms": 1e-3, "cluster time (min)": 60.0,
         "Tau [us]": 1e-6, "tau [h]": 3600.0, "t": 1.0, "time": 1.0}  # fmt: skip
DEVIATIONS = {"adev": 1, "oadev": 1, "OADEV": 1, "Allan deviation": 1, "sigma": 1, "dev": 1, "ad": 0,
              "avar": 2, "oavar": 2, "Allan variance": 2, "variance": 2}  # fmt: skip
SEPARATORS = (
    (",", "."),
    (";", "."),
    (";", ","),
    ("\t", "."),
    ("\t", ","),
    (" ", "."),
    ("   ", "."),
    ("|", "."),
    (", ", "."),
)


def shape(rng: np.random.Generator, path: Path) -> tuple[dict[str, object], int]:
    """Write the twin's curve in a random shape; the options that it needs, and its number of channels."""
    delimiter, decimal = SEPARATORS[rng.integers(len(SEPARATORS))]
    time, deviation = rng.choice(list(TIMES)), rng.choice(list(DEVIATIONS))
    headed, power = rng.random() < 0.7, DEVIATIONS[deviation]
    several = int(rng.integers(1, 4)) if headed and power else 1
    factor, unit = [(1.0, "deg/s"), (3600.0, "deg/h"), (np.pi / 180, "rad/s")][rng.integers(3)]
    options: dict[str, object] = {}
    if not headed or not power:
        power = int(rng.integers(1, 3))
        options["statistic"] = "oadev" if power == 1 else "oavar"
    if " " in delimiter.strip(", ") or delimiter.isspace():  # words of a heading would be cells
        time, deviation = time.split(" ")[0], deviation.replace(" ", "_")
    if "(" not in time and "[" not in time:
        time = time if headed and time in TIMES else "tau"
    seconds = TIMES[time] if headed else 1.0
    columns = {time: LAGS / RATE / seconds}
    inside = "" if not headed or delimiter.isspace() or power == 2 or rng.random() < 0.5 else f" [{unit}]"
    if not inside:
        options["unit"] = unit
    for k in range(several):
        columns[f"{deviation}_{'xyz'[k]}{inside}" if several > 1 else f"{deviation}{inside}"] = (
            twin(k) * factor
        ) ** power
    counts, lags = rng.random() < 0.4, headed and rng.random() < 0.3
    if counts:
        columns["n"] = N - 2 * LAGS + 1
    if lags:
        columns["m"] = LAGS
    if headed and rng.random() < 0.3:
        columns["err_lo"] = columns["err_hi"] = 0.1 * twin()
    if not counts:
        options["samples"] = N
    if not (counts or lags) or rng.random() < 0.3:
        options["rate"] = RATE
    names = list(columns)
    if headed:
        rng.shuffle(names)
    rows = [[f"{columns[n][i]:.11g}".replace(".", decimal) for n in names] for i in range(len(LAGS))]
    lines = ["# made by another program"] * int(rng.integers(0, 3)) + (
        [delimiter.join(names)] if headed else []
    )
    path.write_text("\n".join([*lines, *(delimiter.join(r) for r in rows)]) + "\n", encoding="utf-8")
    return options, several


@pytest.mark.long
def test_two_hundred_shapes_of_a_curve_come_back(tmp_path: Path) -> None:
    for seed in range(100):  # a fault of 2.3 % of them is found with 90 %
        path = tmp_path / f"{seed}.csv"
        options, several = shape(np.random.default_rng(seed), path)
        where = f"seed {seed}, {options}:\n{path.read_text(encoding='utf-8')[:400]}"
        try:
            curve = read_curve(path, **options).curve  # type: ignore[arg-type]
        except AllaniteError as error:
            raise AssertionError(f"{where}\n{error}") from None
        assert (curve.n_samples, len(curve.channels), curve.statistic) == (N, several, "oadev"), where
        assert abs(curve.dt * RATE - 1) < 1e-6, where
        np.testing.assert_array_equal(curve.lags, LAGS, err_msg=where)
        for k in range(several):
            one = curve["xyz"[k]] if several > 1 else curve
            np.testing.assert_allclose(one.deviation[:, 0], np.deg2rad(twin(k)), rtol=1e-9, err_msg=where)
        assert np.all((curve.lower < curve.deviation) & (curve.deviation < curve.upper)), where


def test_it_is_fitted_as_the_curve_of_the_log(tmp_path: Path, run: Run) -> None:
    y = np.random.default_rng(1).standard_normal(N)
    ours = al.allan_curve(al.Recording.from_rate(y, rate=RATE, unit="deg/s"))
    path = tmp_path / "curve.txt"
    rows = [f"{t:.9g} {d:.12g}" for t, d in zip(ours.tau, np.rad2deg(ours.deviation[:, 0]), strict=True)]
    path.write_text("tau oadev\n" + "\n".join(rows) + "\n")
    read = read_curve(path, samples=N, rate=RATE, unit="deg/s").curve
    np.testing.assert_allclose(read.edf, ours.edf, rtol=1e-6)
    given = ("--curve", "--samples", str(N), "--rate", str(RATE), "--unit", "deg/s", "--json")
    done = run("fit", str(path), *given)
    model = next(iter(json.loads(done.out).values()))
    wanted = al.fit(ours).to_json()
    for estimate, other in zip(model["estimates"], wanted["estimates"], strict=True):
        assert estimate["symbol"] == other["symbol"]
        assert estimate["upper"] == pytest.approx(other["upper"], rel=1e-4)


def written(path: Path, *columns: tuple[str, NDArray[np.float64]]) -> Path:
    rows = zip(*(values for _, values in columns), strict=True)
    text = [",".join(name for name, _ in columns)] if any(name for name, _ in columns) else []
    path.write_text("\n".join([*text, *(",".join(f"{v:.10g}" for v in row) for row in rows)]) + "\n")
    return path


TAU, DEV, COUNT = ("tau", LAGS / RATE), ("oadev", twin()), ("n", N - 2.0 * LAGS + 1)
ASKED: dict[str, tuple[list[tuple[str, NDArray[np.float64]]], dict[str, object], str]] = {
    "no length": ([TAU, DEV], {"rate": RATE}, "--samples"),
    "no rate": ([TAU, DEV], {"samples": N}, r"--rate (?!.*--samples)"),
    "neither": ([TAU, DEV], {}, "--rate .*--samples"),
    "neither, of lags": ([("m", LAGS * 1.0), DEV], {}, "--rate .*--samples"),
    "deviation or variance": ([TAU, ("x", twin())], {"samples": N, "rate": RATE}, "deviations or variances"),
    "wrong rate": ([TAU, DEV], {"samples": N, "rate": 70.0}, "whole number"),
    "too short": ([TAU, DEV], {"samples": 2000, "rate": RATE}, "too long for 2000 samples"),
    "length against counts": ([TAU, DEV, COUNT], {"samples": 5000}, "counts imply 4000"),
    "rate against lags": ([TAU, ("m", LAGS * 1.0), DEV], {"rate": 49.0, "samples": N}, "imply 50 Hz"),
    "gaps": ([TAU, DEV, ("n", np.floor(COUNT[1] * np.linspace(1, 0.3, 11)))], {"rate": RATE}, "without gaps"),
    "unit of an angle": ([TAU, DEV], {"samples": N, "rate": RATE, "unit": "deg"}, "rate or acceleration"),
    "unknown statistic": ([TAU, DEV], {"samples": N, "rate": RATE, "statistic": "pdev"}, "must be one of"),
    "no such column": ([TAU, DEV], {"samples": N, "rate": RATE, "channels": ["z"]}, "no column 'z'"),
    "two columns without heading": ([("", LAGS / RATE), ("", twin()), ("", 2 * twin())],
                                    {"samples": N, "rate": RATE, "statistic": "oadev"}, "choose"),
}  # fmt: skip


@pytest.mark.parametrize("case", ASKED)
def test_what_is_not_known_is_asked_for(case: str, tmp_path: Path) -> None:
    columns, options, words = ASKED[case]
    with pytest.raises(InputError, match=words):
        read_curve(written(tmp_path / "c.csv", *columns), **options)  # type: ignore[arg-type]


def test_values_that_are_no_curve_are_refused(tmp_path: Path) -> None:
    options = {"samples": N, "rate": RATE}
    with pytest.raises(DataQualityError, match="not a deviation"):
        read_curve(written(tmp_path / "a.csv", TAU, ("oadev", -twin())), **options)  # type: ignore[arg-type]
    with pytest.raises(DataQualityError, match="averaging times"):
        read_curve(written(tmp_path / "b.csv", ("tau", LAGS[::-1] / RATE), DEV), **options)  # type: ignore[arg-type]


def test_counts_tell_windows_side_by_side(tmp_path: Path, run: Run) -> None:
    path = written(tmp_path / "c.csv", TAU, ("adev", twin()), ("n", np.floor(N / LAGS) - 1.0))
    found = read_curve(path, rate=RATE, unit="deg/s")
    assert (found.curve.statistic, found.curve.n_samples) == ("adev", N)
    assert any("non-overlapping" in remark for remark in found.remarks)
    refused = run("fit", str(path), "--curve", "--rate", "50", "--unit", "deg/s")
    assert refused.code == 1 and "not adev" in refused.err
    assert run("fit", str(path), "--curve", "--rate", "50", "--unit", "deg/s", "--method", "slopes").code == 0


def test_fewer_counts_shorten_the_record_that_intervals_rest_on(tmp_path: Path) -> None:
    lost = written(tmp_path / "c.csv", TAU, DEV, ("n", N - 2.0 * LAGS + 1 - np.minimum(LAGS, 200)))
    found = read_curve(lost, rate=RATE, samples=N)
    assert found.curve.n_samples == N - 200 and any("below" in remark for remark in found.remarks)


@pytest.mark.parametrize("command", ["info", "characterize", "allan", "fit", "spectrum"])
def test_a_log_that_is_a_curve_is_named_as_that(command: str, tmp_path: Path, run: Run) -> None:
    path = written(tmp_path / "c.csv", ("", LAGS / RATE), ("", twin()))
    done = run(command, str(path), "--rate", "50")
    assert done.code == 1 and "looks like an Allan curve" in done.err and "--curve" in done.err


def test_logs_are_not_taken_for_curves() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        n = int(rng.integers(5, 400))
        step = rng.uniform(0.5, 1.5, n) + rng.integers(0, 30, n) * (rng.random(n) < 0.1)
        assert not grows_geometrically(rng.choice([0.0, 1.0, 1e3]) + np.cumsum(step))
        assert not grows_geometrically(rng.standard_normal(n))
    for start in (0.005, 1.0, 60.0):
        for ratio in (1.1, 1.5, 2.0, 10.0):
            lags = np.unique(np.round(ratio ** np.arange(int(np.log(1e5) / np.log(ratio)) + 1)))
            assert len(lags) < 5 or grows_geometrically(start * lags), (start, ratio)


HEADER = {
    "channels": ["null", "[]", "[null]", "{}", '"x"', "7"],
    "missing": ["null", "[]", "{}", "[[[5,2]]]", "[[[0,900]]]", "[[1e30]]", '""'],
    "excluded": ["null", "7", "[[1],[2]]"],
    "statistic": ["null", "median"],
    "confidence": ["null", "0", "1", "NaN", "[]"],
    "N": ["null", "0", "-1", "1e3", "9" * 400],
    "Ts": ["null", "0", "-1", "NaN", "1e400"],
}


@pytest.mark.parametrize("key", HEADER)
def test_headers_that_are_no_curve_are_format_errors(key: str, tmp_path: Path) -> None:
    path = saved_curve(tmp_path)
    lines = path.read_text(encoding="utf-8").split("\n")
    at = next(i for i, line in enumerate(lines) if line.startswith(f"# {key}: "))
    for value in HEADER[key]:
        path.write_text("\n".join([*lines[:at], f"# {key}: {value}", *lines[at + 1 :]]), encoding="utf-8")
        with pytest.raises(FormatError, match="damaged curve file"):
            al.AllanCurve.from_csv(path)


@pytest.mark.parametrize(
    "key", ["name", "kind", "unit", "scale", "sampling", "aperture", "scale_uncertainty", "extra"]
)
def test_channels_of_a_header_hold_what_a_channel_has(key: str, tmp_path: Path) -> None:
    path = saved_curve(tmp_path)
    lines = path.read_text(encoding="utf-8").split("\n")
    at = next(i for i, line in enumerate(lines) if line.startswith("# channels: "))
    (channel,) = json.loads(lines[at].split(": ", 1)[1])
    for value in (None, [], {}, True, -1, [1], "x", 10**400):
        if (value is None and key in ("aperture", "scale_uncertainty")) or (key, value) in (
            ("scale", -1),
            ("name", "x"),
            ("unit", "x"),
        ):
            continue
        text = json.dumps([{**channel, key: value}])
        path.write_text("\n".join([*lines[:at], f"# channels: {text}", *lines[at + 1 :]]), encoding="utf-8")
        with pytest.raises(FormatError, match="damaged curve file"):
            al.AllanCurve.from_csv(path)


@pytest.mark.parametrize("column", range(7))
def test_cells_of_a_saved_curve_are_those_of_a_curve(column: int, tmp_path: Path) -> None:
    path = saved_curve(tmp_path)
    lines = path.read_text(encoding="utf-8").split("\n")
    at = next(i for i, line in enumerate(lines) if line.startswith("m,")) + 2
    for value in ("-1", "-inf", "x", ""):
        cells = lines[at].split(",")
        cells[column] = value
        path.write_text("\n".join([*lines[:at], ",".join(cells), *lines[at + 1 :]]), encoding="utf-8")
        with pytest.raises(FormatError, match="damaged curve file"):
            al.AllanCurve.from_csv(path)


def saved_curve(folder: Path) -> Path:
    y = np.random.default_rng(1).standard_normal(300)
    return al.allan_curve(al.Recording.from_rate(y, rate=10.0, unit="deg/s")).to_csv(folder / "saved.csv")
