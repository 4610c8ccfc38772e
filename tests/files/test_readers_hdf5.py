# SPDX-License-Identifier: BSD-3-Clause
"""HDF5 and MATLAB 7.3 files, written by h5py: exact values, and files that lead out of themselves."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import FormatError, InputError, LimitError
from allanite.files.readers import hdf5, hdf5_tree, matlab, read
from allanite.files.readers.table import Options
from hostile_files import inline, mutations, outcomes, tally

h5py = pytest.importorskip("h5py", reason="the extra allanite[hdf5] is not installed")

RNG = np.random.default_rng(9)
GYRO = RNG.normal(size=(2000, 3)).astype(np.float32)
ACCEL = RNG.normal(size=(2000, 3))


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The child's function without the child: the sandbox has tests of its own, and the samples go through it."""
    monkeypatch.setattr(hdf5, "run", inline)
    monkeypatch.setattr(matlab, "run", inline)


def write(folder: Path, build: Callable[[Any], None], name: str = "log.h5") -> Path:
    path = folder / name
    with h5py.File(path, "w") as file:
        build(file)
    return path


def two_imus(file: Any) -> None:
    for k in (0, 1):
        group = file.create_group(f"imu{k}")
        gyro = group.create_dataset("gyro", data=GYRO + k, chunks=(300, 3), compression="gzip", shuffle=True)
        gyro.attrs["units"] = "deg/s"
        group.create_dataset("acc", data=ACCEL).attrs["unit"] = np.bytes_("g")
        group.create_dataset("timestamp", data=5000 * np.arange(2000)).attrs["units"] = "us"
    file.create_group("mag").create_dataset("field", data=np.zeros((40, 3)))
    file["first"] = h5py.SoftLink("/imu0")
    file["nowhere"] = h5py.SoftLink("/no/such")
    file["imu1/again"] = file["imu0"]  # a cycle of hard links is walked once
    file["imu0/up"] = file["/"]


# -- values ------------------------------------------------------------------------------------------------


def test_the_datasets_of_a_group_are_a_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path, two_imus)
    monkeypatch.setattr(hdf5_tree, "_PIECE", 4000)
    recording = read(path)
    assert set(recording.names) == {f"{g}_{a}" for g in ("gyro", "acc") for a in "xyz"}
    assert (recording.rate, recording.n_samples) == (200.0, 2000)
    for i, axis in enumerate("xyz"):
        assert np.array_equal(recording.values(f"gyro_{axis}"), GYRO[:, i].astype(float))
        assert np.array_equal(recording.values(f"acc_{axis}"), ACCEL[:, i])
    units = {c.name: c.unit for c in recording.channels}
    assert (units["gyro_z"], units["acc_x"]) == ("deg/s", "g")
    assert {c.name: str(k.dtype) for c, k in zip(recording.channels, recording.columns, strict=True)}[
        "gyro_x"
    ] == "float32"
    contents = recording.notes["source"]["contents"]
    assert [c.split(" ")[0] for c in contents] == ["/imu0", "/imu1", "/mag"]
    assert any("/imu1, /mag" in g for g in recording.notes["source"]["guesses"])
    other = read(path, variable="imu1", channels=["gyro"])
    assert np.array_equal(other.values("gyro_x"), (GYRO[:, 0] + np.float32(1)).astype(float))
    one = read(path, variable="/imu1/gyro")
    assert (one.names, one.rate) == (("gyro_x", "gyro_y", "gyro_z"), 200.0)
    with pytest.raises(InputError, match=r"no group 'imu7'.*/imu0 \(2000 rows"):
        read(path, variable="imu7")


@pytest.mark.parametrize("own", [True, False])
def test_a_group_without_time_takes_that_of_the_nearest_group_above(tmp_path: Path, own: bool) -> None:
    def build(file: Any) -> None:
        file["t"] = np.arange(2000) / 25
        file["imu/time"] = np.arange(2000) / 50
        file["imu/time_of_reset"] = np.arange(40.0)  # of another length
        if own:
            file["imu/gyro/time"] = np.arange(2000) / 100
        for axis in range(3):
            file[f"imu/gyro/{'xyz'[axis]}"] = GYRO[:, axis]
        file["imu/accel/data"] = ACCEL

    path = write(tmp_path, build)
    gyro = read(path, variable="imu/gyro")
    assert (gyro.rate, gyro.names) == (100.0 if own else 50.0, ("x", "y", "z"))
    assert np.array_equal(gyro.values("y"), GYRO[:, 1].astype(float))
    assert read(path, variable="imu/accel/data").rate == 50.0


def test_rates_and_fields(tmp_path: Path) -> None:
    def build(file: Any) -> None:
        file.attrs["sample_rate"] = 400
        table = np.zeros(50, dtype=[("gyro", "f4", (3,)), ("temperature", "f8"), ("note", "S3")])
        table["gyro"], table["temperature"] = GYRO[:50], 25.5
        file.create_dataset("log", data=table[["gyro", "temperature"]])

    recording = read(write(tmp_path, build))
    assert recording.rate == 400.0
    assert recording.names == ("gyro_x", "gyro_y", "gyro_z", "temperature")
    assert np.array_equal(recording.values("gyro_y"), GYRO[:50, 1].astype(float))
    by_step = write(tmp_path, lambda f: f.create_dataset("x", data=ACCEL).attrs.update({"dt": 0.02}))
    assert read(by_step).rate == 50.0

    def scalars(file: Any) -> None:
        file["x"], file["fs"], file["columns"] = ACCEL, 125.0, ["gx", "gy", "gz"]

    worded = read(write(tmp_path, scalars))
    assert (worded.rate, worded.names) == (125.0, ("gx", "gy", "gz"))
    with pytest.raises(InputError, match="--rate"):
        read(write(tmp_path, lambda f: f.create_dataset("x", data=ACCEL)))


# -- scaled integers ---------------------------------------------------------------------------------------

COUNTS = RNG.integers(-2000, 2000, size=(500, 3)).astype(np.int16)


def scaled_by(attributes: dict[str, Any], data: Any = COUNTS) -> Callable[[Any], None]:
    def build(file: Any) -> None:
        file.attrs["fs"] = 100.0
        gyro = file.create_dataset("gyro", data=data)
        gyro.attrs.update({"units": "deg/s", **attributes})

    return build


@pytest.mark.parametrize(
    ("key", "value", "counts"),
    [("scale", 0.004, 250), ("Gain", 0.004, 250), ("sensitivity", 131.0, 131), ("conversion_factor", 0.5, 2)],
)
def test_a_scaling_in_other_words_leaves_counts_and_its_advice_scales_them(
    tmp_path: Path, key: str, value: float, counts: float
) -> None:
    path = write(tmp_path, scaled_by({key: value}))
    recording = read(path)
    assert [c.unit for c in recording.channels] == ["LSB"] * 3
    (said,) = recording.notes["source"]["guesses"]
    factor = said.partition('--scale-factor "')[2].rstrip('"')
    assert factor == f"{counts:g} LSB/(deg/s)"
    scaled = read(path, scale_factor=factor)
    assert np.allclose(scaled.scaled("gyro_y"), np.radians(COUNTS[:, 1] / counts))


def test_a_scaling_that_changes_nothing_and_one_of_floats_are_not_mentioned(tmp_path: Path) -> None:
    for attributes, data in (({"scale": 1.0, "offset": 0.0}, COUNTS), ({"scale": 0.1}, ACCEL)):
        recording = read(write(tmp_path, scaled_by(attributes, data)))
        assert recording.channels[0].unit == "deg/s"
        assert recording.notes["source"]["guesses"] == []


def test_an_offset_of_other_words_beside_the_defined_factor_is_reported(tmp_path: Path) -> None:
    recording = read(write(tmp_path, scaled_by({"scale_factor": 0.5, "offset": 3.0})))
    assert recording.channels[0].unit == "deg/s"
    assert np.array_equal(recording.values("gyro_x"), COUNTS[:, 0] * 0.5)
    assert "offset 3 not applied" in recording.notes["source"]["guesses"][0]


@pytest.mark.parametrize("kind", ["<f8", ">f4", "<i2", "u2"])
@pytest.mark.parametrize("key", ["_FillValue", "missing_value"])
def test_a_fill_value_is_missing_without_a_factor_too(tmp_path: Path, kind: str, key: str) -> None:
    data = np.abs(COUNTS).astype(kind)
    data[100:110, 1] = 9999
    recording = read(write(tmp_path, scaled_by({key: np.dtype(kind).type(9999)}, data)))
    missing = np.isnan(recording.values("gyro_y"))
    assert np.flatnonzero(missing).tolist() == list(range(100, 110))
    assert np.array_equal(recording.values("gyro_x"), data[:, 0].astype(float))


def test_a_fill_value_leaves_stamps_of_64_bits_exact(tmp_path: Path) -> None:
    stamps = 1_764_000_000_000_000_100 + 10_000_000 * np.arange(500)

    def build(file: Any) -> None:
        scaled_by({})(file)
        time = file.create_dataset("t", data=stamps)
        time.attrs.update({"units": "ns", "_FillValue": np.int64(-(2**63))})

    table = hdf5.read(write(tmp_path, build), Options())
    column = table.columns[table.headings.index("t")]
    assert column.dtype == np.int64  # float64 has steps of 256 ns there
    assert np.array_equal(column.read(0, 500) + (int(column.origin) - int(stamps[0])), stamps - stamps[0])


# -- out of the file, and never written --------------------------------------------------------------------


@pytest.fixture
def secret(tmp_path: Path) -> Path:
    """Another file, with bytes that are easily found again."""
    path = tmp_path / "secret.bin"
    np.full(600, 1234.5).tofile(path)
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["x"] = np.full((200, 3), 1234.5)
    return path


def external_link(file: Any, folder: Path) -> None:
    file["x"] = h5py.ExternalLink(str(folder / "secret.h5"), "/x")


def external_group(file: Any, folder: Path) -> None:
    file["g"] = h5py.ExternalLink(str(folder / "secret.h5"), "/")
    file["x"] = h5py.SoftLink("/g/x")  # a soft link that leads out by way of the other one


def external_storage(file: Any, folder: Path) -> None:
    file.create_dataset("x", shape=(200, 3), dtype="f8", external=[(str(folder / "secret.bin"), 0, 4800)])


def virtual(file: Any, folder: Path) -> None:
    layout = h5py.VirtualLayout(shape=(200, 3), dtype="f8")
    layout[:] = h5py.VirtualSource(str(folder / "secret.h5"), "x", shape=(200, 3))
    file.create_virtual_dataset("x", layout)


@pytest.mark.parametrize("build", [external_link, external_group, external_storage, virtual])
def test_f5_nothing_outside_of_the_file_is_read(
    tmp_path: Path, secret: Path, build: Callable[..., None]
) -> None:
    path = write(tmp_path, lambda file: build(file, tmp_path))
    with pytest.raises(FormatError, match="leads out of itself"):
        read(path, rate=1)
    with pytest.raises((FormatError, InputError)):
        read(path, rate=1, variable="x")
    with h5py.File(path, "a") as file:
        file["good"] = ACCEL
    with pytest.raises(FormatError, match="leads out of itself"):
        read(path, rate=1)
    kept = read(path, rate=1, variable="good")
    assert kept.n_samples == 2000
    assert not any((kept.values(n) == 1234.5).any() for n in kept.names)


def test_f5_cycles_and_declarations_without_samples(tmp_path: Path) -> None:
    def cycle(file: Any) -> None:
        file["a"], file["b"] = h5py.SoftLink("/b"), h5py.SoftLink("/a")

    with pytest.raises(InputError, match="there are: nothing"):
        read(write(tmp_path, cycle), rate=1)
    declared = write(tmp_path, lambda f: f.create_dataset("x", shape=(10**12,), dtype="f8", chunks=(1000,)))
    with pytest.raises(FormatError, match="only 0 were written"):
        read(declared, rate=1)

    def half(file: Any) -> None:  # what a writer leaves that was killed
        file.create_dataset("x", shape=(2000, 3), dtype="f8", chunks=(100, 3))[:1000] = ACCEL[:1000]

    with pytest.raises(FormatError, match="declares 20 chunks of samples, but only 10 were written"):
        read(write(tmp_path, half), rate=1)
    bomb = write(
        tmp_path,
        lambda f: f.create_dataset("x", data=np.zeros(5_000_000), chunks=(1_000_000,), compression=9),
    )
    with pytest.raises(LimitError, match="bomb"):
        read(bomb, rate=1)


def test_filters_of_others_are_named(tmp_path: Path) -> None:
    path = write(tmp_path, lambda f: f.create_dataset("x", data=ACCEL, chunks=(500, 3), compression="lzf"))
    assert np.array_equal(read(path, rate=1).values("ch1"), ACCEL[:, 1])
    content = path.read_bytes()
    assert content.count(b"lzf\0") >= 1
    at = content.index(b"lzf\0") - 8
    number = content.index((32000).to_bytes(2, "little"), at - 16)
    path.write_bytes(content[:number] + (32015).to_bytes(2, "little") + content[number + 2 :])
    with pytest.raises(FormatError, match=r"filter 32015.*h5repack"):
        read(path, rate=1)


def test_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hdf, mat = write(tmp_path, two_imus), matlab_file(tmp_path, lambda f: None)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'pip install "allanite\[hdf5\]"'):
        read(hdf)
    with pytest.raises(InputError, match=r'pip install "allanite\[matlab\]".*-v7'):
        read(mat)


def test_damaged_files_harm_nothing(tmp_path: Path) -> None:
    def small(file: Any) -> None:
        group = file.create_group("imu")
        group.attrs["fs"] = 100.0
        group.create_dataset("gyro", data=GYRO[:60], chunks=(20, 3), compression="gzip").attrs["units"] = (
            "deg/s"
        )
        group.create_dataset("acc", data=ACCEL[:60])

    sound = write(tmp_path, small)
    files = []
    for i, mutant in enumerate(mutations(sound.read_bytes(), 60)):
        files.append(tmp_path / f"{i}.h5")
        files[-1].write_bytes(mutant)
    found = tally(outcomes(sound, files))
    assert found["read"] > 5 and found["refused"] > 5, found
    assert not found.keys() & {"another error", "signal 14"}, found


# -- MATLAB 7.3 --------------------------------------------------------------------------------------------


def matlab_file(folder: Path, build: Callable[[Any], None]) -> Path:
    """An HDF5 file behind the header of MATLAB."""
    path = folder / "log.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        build(file)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
    return path


def put(group: Any, name: str, values: Any, kind: str = "double") -> Any:
    """A variable as MATLAB stores it: dimensions the other way round, texts as numbers."""
    if kind == "char":
        values = np.array([[ord(c) for c in values]], dtype=np.uint16)
    dataset = group.create_dataset(name, data=np.atleast_2d(values).T)
    dataset.attrs["MATLAB_class"] = np.bytes_(kind)
    return dataset


def test_matrices_texts_and_structures_of_matlab(tmp_path: Path) -> None:
    def build(file: Any) -> None:
        imu = file.create_group("imu")
        imu.attrs["MATLAB_class"] = np.bytes_("struct")
        put(imu, "gyro", GYRO, "single")
        put(imu, "acc", ACCEL)
        put(imu, "t", 0.01 * np.arange(2000))
        put(imu, "sensor", "MPU", "char")
        references = file.create_group("#refs#")
        words = [put(references, f"c{k}", w, "char").ref for k, w in enumerate(("deg/s", "m"))]
        cell = file.create_dataset("words", data=np.array(words, dtype=object)[:, None], dtype=h5py.ref_dtype)
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
        empty = put(file, "nothing", np.zeros(2))
        empty.attrs["MATLAB_empty"] = np.uint8(1)

    recording = read(matlab_file(tmp_path, build), unit={"gyro": "deg/s", "acc": "m/s²"})
    assert recording.names == ("acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z")
    assert recording.rate == pytest.approx(100.0, rel=1e-12)
    for i, axis in enumerate("xyz"):
        assert np.array_equal(recording.values(f"gyro_{axis}"), GYRO[:, i].astype(float))
        assert np.array_equal(recording.values(f"acc_{axis}"), ACCEL[:, i])
    arrays = inline("allanite.files.readers.matlab_hdf5:arrays_in", [str(tmp_path / "log.mat")])[1]
    assert arrays["imu.sensor"].tolist() == ["MPU"]
    assert arrays["words"].tolist() == ["deg/s", "m"]
    assert "nothing" not in arrays


@pytest.mark.parametrize("describing", [{"fs": 200.0}, {"t": 0.005 * np.arange(2000)}, {"dt_ms": 5.0}])
@pytest.mark.parametrize("version", [5, 7.3])
def test_what_stands_beside_a_structure_describes_it(
    tmp_path: Path, describing: dict[str, Any], version: float
) -> None:
    from scipy.io import savemat

    def build(file: Any) -> None:
        imu = file.create_group("imu")
        imu.attrs["MATLAB_class"] = np.bytes_("struct")
        put(imu, "gyro", GYRO)
        for name, value in describing.items():
            put(file, name, value)
        put(file, "other", ACCEL)

    if version == 5:
        savemat(tmp_path / "log.mat", {"imu": {"gyro": GYRO}, "other": ACCEL, **describing})
    else:
        matlab_file(tmp_path, build)
    recording = read(tmp_path / "log.mat", variable="imu")
    assert recording.names == ("gyro_x", "gyro_y", "gyro_z")
    assert recording.rate == pytest.approx(200.0)


def _version_5_of_what_is_not_plain(folder: Path, kept: dict[str, Any]) -> Path:
    from scipy.io import savemat

    cell = np.empty((1, 3), dtype=object)
    cell[0, :] = [GYRO[:, k].astype(float) for k in range(3)]
    runs = np.zeros((2,), dtype=[("gyro", object), ("t", object)])
    runs[:] = [(GYRO[:, 0], np.arange(2000.0)), (GYRO[:, 1], np.arange(2000.0))]
    savemat(folder / "log.mat", {"cell": cell, "runs": runs, "turning": ACCEL[:, 0] + 1j, **kept})
    return folder / "log.mat"


def _version_73_of_what_is_not_plain(folder: Path, kept: dict[str, Any]) -> Path:
    def build(file: Any) -> None:
        references = file.create_group("#refs#")
        of = [put(references, f"c{k}", GYRO[:, k]).ref for k in range(3)]
        cell = file.create_dataset("cell", data=np.array(of, dtype=object)[:, None], dtype=h5py.ref_dtype)
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
        runs = file.create_group("runs")
        runs.attrs["MATLAB_class"] = np.bytes_("struct")
        for name in ("gyro", "t"):
            runs.create_dataset(name, data=np.array(of[:2], dtype=object)[:, None], dtype=h5py.ref_dtype)
        pairs = np.zeros((1, 2000), dtype=[("real", "f8"), ("imag", "f8")])
        file.create_dataset("turning", data=pairs).attrs["MATLAB_class"] = np.bytes_("double")
        for name, value in kept.items():
            put(file, name, value)

    return matlab_file(folder, build)


@pytest.mark.parametrize("made", [_version_5_of_what_is_not_plain, _version_73_of_what_is_not_plain])
def test_cells_structures_and_complex_numbers_of_matlab_are_named(
    tmp_path: Path, made: Callable[[Path, dict[str, Any]], Path]
) -> None:
    alone = made(tmp_path, {"fs": 200.0})
    lines = {"cell": "x = cell{1};", "runs": "x = runs(1);", "turning": "real(turning(:))"}
    for options in ({}, {"rate": 200.0}):  # the scalar is never taken for the samples
        with pytest.raises(FormatError) as refused:
            read(alone, **options)
        assert all(line in str(refused.value) for line in lines.values())
    for name, line in lines.items():
        with pytest.raises(FormatError, match=re.escape(line)):
            read(alone, variable=name)
    beside = read(made(tmp_path, {"fs": 200.0, "acc": ACCEL}))
    assert beside.n_samples == 2000
    said = beside.notes["source"]["guesses"]
    assert all(any(line in sentence for sentence in said) for line in lines.values())


def test_version_7_3_gives_what_version_5_gives(tmp_path: Path) -> None:
    from scipy.io import savemat

    content = {"gyro": GYRO, "fs": 200.0, "units": "deg/s"}
    savemat(tmp_path / "old.mat", content)

    def build(file: Any) -> None:
        for name, value in content.items():
            put(file, name, value, "char" if isinstance(value, str) else "double")

    old, new = read(tmp_path / "old.mat"), read(matlab_file(tmp_path, build))
    assert (
        (new.rate, new.names, new.channels)
        == (old.rate, old.names, old.channels)
        == (200.0, old.names, old.channels)
    )
    assert all(np.array_equal(new.values(n), old.values(n)) for n in old.names)


def test_matlab_files_that_lead_out_or_are_cut(tmp_path: Path, secret: Path) -> None:
    with pytest.raises(FormatError, match="leads out of itself"):
        read(matlab_file(tmp_path, lambda f: external_link(f, tmp_path)), rate=1)
    half = matlab_file(
        tmp_path, lambda f: f.create_dataset("x", shape=(3, 9000), dtype="f8", chunks=(3, 100))
    )
    with pytest.raises(FormatError, match="only 0 were written"):
        read(half, rate=1)
    cut = tmp_path / "cut.mat"
    cut.write_bytes(matlab_file(tmp_path, lambda f: put(f, "x", ACCEL)).read_bytes()[:3000])
    with pytest.raises(FormatError, match="damaged"):
        read(cut, rate=1)


def test_damaged_matlab_files_harm_nothing(tmp_path: Path) -> None:
    sound = matlab_file(tmp_path, lambda f: (put(f, "gyro", GYRO[:50]), put(f, "fs", 100.0)))
    files = []
    for i, mutant in enumerate(mutations(sound.read_bytes(), 30)):
        files.append(tmp_path / f"{i}.mat")
        files[-1].write_bytes(mutant)
    found = tally(outcomes(sound, files))
    assert not found.keys() & {"another error", "signal 14"}, found
