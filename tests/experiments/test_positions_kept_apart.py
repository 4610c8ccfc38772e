# SPDX-License-Identifier: BSD-3-Clause
"""Positions that are kept one by one, as files or as rows of means: they say what the one log of all of them says."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, chi2, f

import unit_twin
from allanite.commands.recordings import options_of
from allanite.errors import DataQualityError, InputError, LimitError
from allanite.experiments.calibration import CalibrationEstimate, calibrate, calibrate_means
from allanite.experiments.reversals import joined_files
from allanite.experiments.static_spans import PositionMeans, means_of
from allanite.files.recording_file import write_recording
from allanite.filtering.simulation import UnitMotion, simulate_unit
from allanite.quantities.earth import DEG_H, earth_rate_vector
from allanite.recording.calibration import errors_of, parameter_names
from allanite.recording.records import ArrayColumn, Channel, Recording
from allanite.study.model_file import model_of
from shell import Run

G, LATITUDE, RATE = 9.81, 0.8, 50.0
ACC, GYRO = tuple(f"accel_{a}" for a in "xyz"), tuple(f"gyro_{a}" for a in "xyz")
FORCES = parameter_names("accelerometer", frame="z")
NAMES = FORCES + parameter_names("gyro")
MODELS = dict.fromkeys(ACC, model_of("N=0.06 m/s/√h")) | dict.fromkeys(GYRO, model_of("N=1 deg/√h"))


def truth(seed: int) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    return {n: (".scale_" in n) + 0.01 * float(rng.standard_normal()) for n in NAMES}


def attitudes(count: int, seed: int) -> list[np.ndarray]:
    """The six faces first, the others anyhow; all with any heading."""
    rng = np.random.default_rng(seed)
    ups = np.concatenate([np.eye(3), -np.eye(3), rng.standard_normal((count - 6, 3))])
    return [unit_twin.attitude_up(u, h) for u, h in zip(ups, rng.uniform(0, 6.28, count), strict=True)]


def rows(values: dict[str, float], count: int, seed: int, sd: tuple[float, float]) -> Recording:
    """A table of means of both triads, with noise of this size [m/s^2], [rad/s]."""
    rng, where = np.random.default_rng(seed), np.array(attitudes(count, seed))
    force, rate = -G * where[:, 2], np.swapaxes(where, 1, 2) @ earth_rate_vector(LATITUDE)
    seen = (errors_of(values, "accelerometer").seen(force), errors_of(values, "gyro").seen(rate))
    columns = np.concatenate(
        [y + s * rng.standard_normal(y.shape) for y, s in zip(seen, sd, strict=True)], axis=1
    )
    return table(columns, ACC + GYRO, ["m/s²"] * 3 + ["rad/s"] * 3)


def table(columns: np.ndarray, names: tuple[str, ...], units: list[str]) -> Recording:
    return Recording(
        channels=tuple(Channel.of(n, u) for n, u in zip(names, units, strict=True)),
        columns=tuple(ArrayColumn(c) for c in columns.T),
        rate=1.0,
    )


def misfit(found: CalibrationEstimate, values: dict[str, float], names: tuple[str, ...]) -> float:
    """Chi-square of parameters against the truth, with their covariance."""
    place = [found.calibration.names.index(n) for n in names]
    apart = found.calibration.values[place] - [values[n] for n in names]
    return float(apart @ np.linalg.solve(found.calibration.covariance[np.ix_(place, place)], apart))


# -- files and rows against the one log ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def log() -> tuple[dict[str, float], unit_twin.Path, Recording]:
    values, path = truth(3), unit_twin.Path(attitudes(14, 4), rate=RATE, dwell=6.0, latitude=LATITUDE)
    both = errors_of(values, "accelerometer"), errors_of(values, "gyro")
    return values, path, path.recording(*both, MODELS, seed=5)


def test_files_and_rows_give_the_parameters_of_the_one_log(log) -> None:
    values, path, whole = log
    known = {"model": MODELS, "latitude": LATITUDE, "gravity": G}
    one = calibrate(whole, spans=path.spans, **known)
    files = [whole.window(a / RATE, b / RATE) for a, b in path.spans]
    joined, spans, apart = joined_files(
        [replace(r, source=f"{k}.csv") for k, r in enumerate(files)], between=2.0
    )
    by_file = calibrate(joined, spans=np.array(spans), **known)
    averages = np.array([[np.mean(r.scaled(n)) for n in whole.names] for r in files])
    kept = means_of(table(averages, whole.names, [c.unit for c in whole.channels]), averaging=6.0)
    by_row = calibrate_means(kept, **known)
    assert "2 s between them are assumed" in apart.says[0]
    limit = chi2.ppf(0.999, len(FORCES))
    biases = tuple(f"gyro.bias_{a}" for a in "xyz")
    for found in (by_file, by_row):
        assert misfit(found, values, FORCES) < limit
        assert misfit(found, values, biases) < chi2.ppf(0.999, 3)
        assert not any(t.used for t in found.turns)
        open_ = {p.name for p in found.parameters if p.status == "assumed"}
        assert open_ == {n for n in NAMES if n.startswith("gyro.") and "bias" not in n}
        assert any("only turns show the scale factors" in a for a in found.advice)
        assert not found.add  # another position would not help
        for name in FORCES:  # without turns the sphere alone is left of what gravity says
            assert found[name].sd >= 0.99 * one[name].sd
    for name in FORCES + biases:  # the same readings
        assert by_row[name].value == pytest.approx(by_file[name].value, abs=0.05 * by_file[name].sd)
        assert by_row[name].sd == pytest.approx(by_file[name].sd, rel=0.02)


def test_units_differ_from_file_to_file(log) -> None:
    _, path, whole = log
    a, b = (whole.window(x / RATE, y / RATE).select(*ACC) for x, y in path.spans[:2])
    in_g = tuple(Channel.of(n, "g") for n in ACC)
    other = replace(b, channels=in_g, columns=tuple(ArrayColumn(b.values(n) / 9.80665) for n in ACC))
    plain, mixed = joined_files([a, b])[0], joined_files([a, other])[0]
    for name in ACC:
        np.testing.assert_allclose(mixed.scaled(name), plain.scaled(name), rtol=1e-12)


# -- what tells the noise of a mean -------------------------------------------------------------------------


@pytest.mark.long
def test_scatter_alone_gives_intervals_that_hold_as_often_as_they_say() -> None:
    """Nine parameters at a time, by Fisher's law with the degrees of freedom that are stated."""
    count, inside, hits = 40, 0, 0
    for seed in range(count):
        values = truth(seed)
        found = calibrate_means(PositionMeans(rows=rows(values, 13, seed, (5e-4, 1.0))), gravity=G, gyro=())
        assert found.verdict == "calibrated" and found.model_source == "scatter of the positions"
        (scatter,) = found.scatter
        assert scatter.sd_dof == pytest.approx(13 - 9, abs=0.1)
        inside += misfit(found, values, FORCES) / 9 < f.ppf(0.95, 9, scatter.sd_dof)
        low, high = found["accelerometer.scale_y"].interval
        hits += low <= values["accelerometer.scale_y"] <= high
    low, high = binom.ppf([0.0005, 0.9995], count, 0.95)
    assert low <= inside <= high and low <= hits <= high


def test_nothing_is_said_of_the_noise_where_nothing_tells_it() -> None:
    six = PositionMeans(rows=rows(truth(1), 6, 1, (5e-4, 1e-4)))
    with pytest.raises(DataQualityError, match=r"the noise of the accelerometer is unknown: 6 positions"):
        calibrate_means(six, gravity=G, gyro=())
    with pytest.raises(InputError, match="--averaging 60s, or in a column duration"):
        calibrate_means(six, gravity=G, model=MODELS)
    told = calibrate_means(replace(six, duration=np.full(6, 60.0)), gravity=G, model=MODELS)
    assert told["accelerometer.bias_x"].sd > 0
    with pytest.raises(LimitError, match="is read without --means"):
        means_of(table(np.ones((201, 3)), ACC, ["m/s²"] * 3))
    with pytest.raises(InputError, match="no turns between them"):
        calibrate_means(six, gravity=G, without=[(1, 2)])


def test_standard_deviations_of_the_table_are_taken_for_what_they_are() -> None:
    values = truth(2)
    readings = rows(values, 16, 2, (5e-4, 1e-4)).select(*ACC)
    columns = [*(readings.values(n) for n in ACC), *[np.full(16, 0.05)] * 3, np.full(16, 10_000.0)]
    names, units = (*ACC, *(f"{n}_sd" for n in ACC), "n"), ["m/s²"] * 6 + ["unknown"]
    whole = table(np.stack(columns, axis=1), names, units)
    means = means_of(whole)
    assert means.rows.names == ACC and "divided by the root of their number (n)" in means.sd_columns.says
    np.testing.assert_allclose(means.sds(ACC), 5e-4)
    found = calibrate_means(means, gravity=G)
    assert found.model_source == "standard deviations of the table"
    assert misfit(found, values, FORCES) < chi2.ppf(0.999, 9)
    np.testing.assert_allclose(means_of(whole, sd_of="means").sds(ACC), 0.05)
    with pytest.raises(InputError, match="of the readings, or of their means"):
        means_of(whole.select(*names[:-1]))
    with pytest.raises(InputError, match="give all three, or none"):
        means_of(whole.select(*names[:4], "n")).sds(ACC)


@pytest.mark.parametrize(
    "name",
    ["ax_sd", "sd_ax", "ax_std", "std ax", "sigma_ax", "ax stdev", "ax_mean_sd", "σ_ax", "ax_sem", "u_ax"],
)
def test_columns_of_deviations_are_known_by_their_names(name: str) -> None:
    whole = table(np.ones((3, 3)), ("ax_mean", name, "samples"), ["g", "g", "unknown"])
    found = means_of(whole)
    assert found.rows.names == ("ax_mean",)
    assert found.sd["ax_mean"] == pytest.approx(np.full(3, 9.80665))


@pytest.mark.parametrize(("noise", "told"), [(20 * DEG_H, False), (0.05 * DEG_H, True)])
def test_gyros_find_the_headings_by_the_earth_or_say_what_it_costs(noise: float, told: bool) -> None:
    values = truth(7)
    found = calibrate_means(
        PositionMeans(rows=rows(values, 16, 7, (5e-4, noise))), gravity=G, latitude=LATITUDE
    )
    assert (found.earth is not None) == told
    assert any("the headings of the positions are unknown" in r for r in found.notes) != told
    for axis in "xyz":
        p = found[f"gyro.bias_{axis}"]
        assert abs(p.value - values[p.name]) < 4.5 * p.sd
        assert (p.sd > 5 * DEG_H) != told


# -- the commands -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, log) -> Path:
    """Fourteen files of one position each, with the gyros, and the table of their means."""
    place = tmp_path_factory.mktemp("positions")
    _, path, whole = log
    lines = [",".join(f"{c.name} [{c.unit}]" for c in whole.channels)]
    for k, (a, b) in enumerate(path.spans):
        part = whole.window(a / RATE, b / RATE)
        write_recording(part, place / f"p{k:02d}.parquet")
        lines.append(",".join(f"{np.mean(part.values(n)):.9f}" for n in whole.names))
    (place / "means.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
    return place


@pytest.mark.long
def test_calibrate_takes_files_and_rows(run: Run, folder: Path, tmp_path: Path, log) -> None:
    files, known = sorted(folder.glob("p*.parquet")), ["--latitude", f"{LATITUDE}rad", "--gravity", "9.81"]
    done = run("calibrate", "--positions", *files, *known, "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert [Path(part["file"]).name for part in document["files"]] == [f.name for f in files]
    assert not any(finding["code"] == "missing" for finding in document["findings"])
    assert document["apart"]["assumed"] == 60.0
    assert any("60 s between them are assumed" in r for r in CalibrationEstimate.from_json(document).notes)
    done = run("calibrate", "--means", folder / "means.csv", *known, "--out", tmp_path / "rows")
    assert done.code == 0, done.err
    document = json.loads((tmp_path / "rows" / "calibration.json").read_text(encoding="utf-8"))
    assert document["positions"][0]["start"] is None and document["rate"] is None
    assert "Only turns show the scale factors" in " ".join(done.out.split())
    assert "scatter of the positions" in done.out and "14 positions (rows of means)" in done.out
    for words, message in (
        ([files[0], files[1]], "several LOGs are for --positions"),
        (["--positions", files[0], files[0]], "is given twice"),
        (["--positions", files[0]], "at least two files"),
        (["--positions", *files, "--spans", files[0]], "--spans is for one log"),
        (["--means", folder / "means.csv", "--spans", files[0]], "leave it out with --means"),
        (["--means", folder / "means.csv", "--rate", "10"], "--rate is for logs"),
        ([files[0], "--averaging", "60"], "goes with --means"),
    ):
        refused = run("calibrate", *words, *known)
        assert refused.code != 0 and message in " ".join(refused.err.split()), words


def test_a_file_in_which_the_unit_moved_is_named(run: Run, folder: Path, tmp_path: Path, log) -> None:
    whole, rng = log[2], np.random.default_rng(1)
    moved = whole.window(0, 6)
    shaken = tuple(ArrayColumn(moved.values(n) + np.cumsum(rng.standard_normal(300))) for n in moved.names)
    write_recording(replace(moved, columns=shaken), tmp_path / "moved.parquet")
    files = [*sorted(folder.glob("p*.parquet"))[:4], tmp_path / "moved.parquet"]
    done = run("calibrate", "--positions", *files, "--gravity", "9.81")
    assert done.code == 1
    assert "moved.parquet: the unit is never at rest" in " ".join(done.err.split())


@pytest.mark.long
def test_align_goes_by_stated_headings_where_no_gyro_saw_the_turn(run: Run, tmp_path: Path) -> None:
    noise = {"gyro": model_of("N=0.02 deg/√h"), "accelerometer": model_of("N=0.02 m/s/√h")}
    motion = UnitMotion.positions([(0, 0, 0.5), (0.1, 0, 0.5 + 2.0)], dwell=100.0, turn=4.0)
    whole = simulate_unit(noise, rate=20.0, motion=motion, latitude=0.84, seed=1, axes="FLU")
    parts = [whole.window(0, 100), whole.window(104, 204)]
    heading = math.degrees(2.0)
    table_ = [",".join([*(f"{c.name} [{c.unit}]" for c in whole.channels), "heading"])]
    for name, part, turned in zip("ab", parts, (0.0, heading), strict=True):
        write_recording(part, tmp_path / f"{name}.parquet")
        table_.append(",".join(f"{np.mean(part.values(n)):.12g}" for n in whole.names) + f",{turned}")
    (tmp_path / "means.csv").write_text("\n".join([*table_, ""]), encoding="utf-8")
    models = {n: noise["gyro" if n.startswith("gyro") else "accelerometer"].to_json() for n in whole.names}
    (tmp_path / "models.json").write_text(json.dumps(models), encoding="utf-8")
    known = ["--model", tmp_path / "models.json", "--latitude", "0.84rad", "--between", "4", "--json"]
    files = [f"{tmp_path / 'a.parquet'}=0", f"{tmp_path / 'b.parquet'}={heading}"]
    sds = []
    for words in (["--positions", *files], ["--means", tmp_path / "means.csv", "--averaging", "100"]):
        done = run("align", *words, *known)
        assert done.code == 0, done.err
        found = json.loads(done.out)["last"]
        assert abs(math.remainder(found["heading"] - 2.5, 2 * math.pi)) < 4 * found["heading_sd"]
        sds.append(found["heading_sd"])
    assert sds[1] == pytest.approx(sds[0], rel=0.05)
    wide = run("align", "--positions", *files, *known, "--heading-uncertainty", "5deg")
    assert json.loads(wide.out)["last"]["heading_sd"] > math.radians(3)
    bare = run("align", "--positions", *(text.partition("=")[0] for text in files), *known)
    document = json.loads(bare.out)
    assert len(document["stands"]) == 1
    assert "state the headings" in document["remarks"]
    half = run("align", "--positions", files[0], files[1].partition("=")[0], *known)
    assert half.code == 1 and "of every position, or of none" in " ".join(half.err.split())
    lacking = run("align", "--means", tmp_path / "means.csv", "--averaging", "100", "--latitude", "48")
    assert lacking.code == 1 and "means carry no noise information" in " ".join(lacking.err.split())


@pytest.mark.long
def test_models_go_by_the_names_that_are_mapped(run: Run, folder: Path, tmp_path: Path) -> None:
    """Of align and calibrate, for files and rows; the same as with the names of the log."""
    mapped = {name: f"m{k}" for k, name in enumerate(ACC + GYRO)}
    for path, names in ((tmp_path / "own.json", {n: n for n in mapped}), (tmp_path / "other.json", mapped)):
        path.write_text(json.dumps({names[n]: m.to_json() for n, m in MODELS.items()}), encoding="utf-8")
    called = ["--model-channels", ",".join(f"{a}={b}" for a, b in mapped.items())]
    for command, words in (
        ("calibrate", ["--means", folder / "means.csv", "--averaging", "6"]),
        ("align", [folder / "p00.parquet", "--axes", "FRD"]),
    ):
        arguments = [command, *words, "--latitude", f"{LATITUDE}rad", "--json"]
        own = run(*arguments, "--model", tmp_path / "own.json")
        other = run(*arguments, "--model", tmp_path / "other.json", *called)
        assert (own.code, other.code) == (0, 0), other.err
        key = "parameters" if command == "calibrate" else "last"
        assert json.loads(own.out)[key] == json.loads(other.out)[key]
        refused = run(*arguments, "--model", tmp_path / "other.json")
        (way,) = re.findall(r"--model-channels ([^\s)]+)", refused.err)
        copied = run(*arguments, "--model", tmp_path / "other.json", "--model-channels", way)
        assert json.loads(copied.out)[key] == json.loads(own.out)[key]


def test_north_of_rows_of_means(run: Run, tmp_path: Path) -> None:
    rng, known = np.random.default_rng(4), ["--model", "N=0.1 deg/√h", "--latitude", "48.1", "--json"]
    sd = 0.1 / math.sqrt(300 / 3600)
    level = 15.041 * math.cos(math.radians(48.1))
    lines = ["heading,g [deg/h],duration [min]"]
    for heading in (0, 90, 180, 270):
        rate = level * math.cos(math.radians(heading + 30)) + 5 + sd * rng.standard_normal()
        lines.append(f"{heading},{rate:.6f},5")
    (tmp_path / "means.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
    done = run("north", "--means", tmp_path / "means.csv", *known)
    assert done.code == 0, done.err
    found = json.loads(done.out)
    expected = sd / math.sqrt(2) / level  # two of four rows for each component
    assert found["sd"] == pytest.approx(expected, rel=0.05)
    assert abs(found["azimuth"] - math.radians(30)) < 4 * expected
    (tmp_path / "bare.csv").write_text("g [deg/h]\n1\n2\n3\n", encoding="utf-8")
    bare = run("north", "--means", tmp_path / "bare.csv", "--averaging", "300", *known)
    assert bare.code == 1 and "no column heading" in bare.err


@pytest.mark.parametrize("lost", [0, 4])
def test_the_time_between_files_is_nothing_missing(run: Run, tmp_path: Path, lost: int) -> None:
    """Of four files of two minutes only what they lost themselves is missing, however long the turns took."""
    rng, rate, n = np.random.default_rng(5), 20.0, 2400
    level = math.radians(15.041 / 3600) * math.cos(math.radians(48.1))
    files = []
    for heading in (0, 90, 180, 270):
        y = level * math.cos(math.radians(heading + 30)) + 3e-5 * math.sqrt(rate) * rng.standard_normal(n)
        rows = np.delete(np.column_stack([np.arange(n) / rate, y]), np.s_[700 : 700 + lost], axis=0)
        name = tmp_path / f"p{heading}.csv"
        np.savetxt(name, rows, fmt="%.9g", delimiter=",", header="t [s],g [rad/s]", comments="")
        files.append(f"{name}={heading}")
    found = run(
        *["north", *files, "--positions", "--between", "90s"],
        *["--model", "N=3e-5 rad/s/√Hz", "--latitude", "48.1", "--json"],
    )
    assert found.code == (3 if lost else 0), found.err
    said = {f["code"]: f for f in json.loads(found.out)["findings"]}
    assert ("missing" in said) == bool(lost)
    if lost:
        assert said["missing"]["count"] == 4 * lost
        assert said["missing"]["message"].startswith(
            f"{4 * lost} of {4 * n} samples in the files missing (0.17 %)"
        )


# -- each log its own units ---------------------------------------------------------------------------------


@pytest.mark.long
def test_each_of_several_logs_has_its_own_units(run: Run, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    force = rng.standard_normal((2000, 1)) * 1e-3
    logs = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for log_, size in zip(logs, (1.0, 9.80665), strict=True):
        lines = "\n".join(["ax", *(f"{x:.9f}" for x in (force[:, 0] * size).tolist()), ""])
        log_.write_text(lines, encoding="utf-8")
    a, b = logs
    for units in ([f"{a}=g,{b}=m/s^2"], [f"acc=g,{b}:acc=m/s^2"], [f"{a}:ax=g", "--unit", f"{b}:ax=m/s^2"]):
        done = run("compare", a, b, "--rate", "100", "--unit", *units, "--json")
        assert done.code == 0, done.err
        (channel,) = json.loads(done.out)["channels"]
        first, second = (r["value"] for r in channel["parameters"][0]["records"])
        assert second == pytest.approx(first, rel=1e-3)
    rates = run("compare", a, b, "--rate", f"{a}=100", "--rate", f"{b}=50", "--unit", "g", "--json")
    assert [r["rate"] for r in json.loads(rates.out)["records"]] == [100.0, 50.0]
    lost = run("compare", a, b, "--rate", "100", "--unit", "no.csv=g")
    assert lost.code == 1 and "no such channel or group" in " ".join(lost.err.split())


def test_options_of_one_log_are_its_own(tmp_path: Path) -> None:
    a, b = tmp_path / "a.csv", tmp_path / "b.csv"
    for path in (a, b):
        path.touch()
    both = {"unit": {f"{a}:acc": "g", "gyro": "deg/s", str(b): "V"}, "rate": {str(b): 5.0}, "time": "t"}
    assert options_of(a, both) == {"unit": {"gyro": "deg/s", "acc": "g"}, "rate": None, "time": "t"}
    assert options_of(b, both) == {"unit": "V", "rate": 5.0, "time": "t"}
