# SPDX-License-Identifier: BSD-3-Clause
"""Sound files of every format that is read: made here, small, and those of ``tests/samples``."""

from __future__ import annotations

import functools
import gzip
import json
import operator
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from tests import flight_log_writers as logs
from tests import log_store_runs as runs
from tests import mavlink_writer, r_writers
from tests import ros_writers as ros
from tests import spreadsheet_writers as sheets

__all__ = ["FORMATS", "Format", "Seed", "placed", "seeds_of"]

Json = dict[str, Any]
Files = Mapping[str, bytes]

_N = 60
_SAMPLES = Path(__file__).parent.parent / "samples"
_LARGEST = 60_000  # bytes of a sample that is taken as a seed


@dataclass(frozen=True, slots=True, kw_only=True)
class Seed:
    """What is mutated: files beside each other, the one that is opened, or "" for their folder."""

    files: Files
    opened: str
    role: str
    options: Json = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """A format: how a sound file of it is written, how it is opened, and which samples are of it."""

    file: str
    write: Callable[[Path], Any]
    role: str = "log"
    options: Json = field(default_factory=dict)
    samples: str = ""


def placed(seed: Seed, folder: Path) -> Path:
    """Write the files of a seed into a folder of its own; what is to be opened."""
    inner = folder / "inner"
    inner.mkdir(parents=True)
    for name, content in seed.files.items():
        (inner / name).write_bytes(content)
    return inner / seed.opened if seed.opened else inner


def seeds_of(name: str) -> list[Seed]:
    """Seeds of a format: the one that is written here first, then its samples."""
    one = FORMATS[name]
    found = [_written(one)]
    for pattern in one.samples.split():
        for path in sorted(_SAMPLES.glob(pattern)):
            content = path.read_bytes()
            if len(content) <= _LARGEST:
                found.append(
                    Seed(files={path.name: content}, opened=path.name, role=one.role, options=one.options)
                )
    return found


def _written(one: Format) -> Seed:
    with tempfile.TemporaryDirectory(prefix="allanite-") as place:
        path = Path(place) / one.file
        one.write(path)
        if path.is_dir():
            files = {p.name: p.read_bytes() for p in sorted(path.iterdir())}
            return Seed(files=files, opened="", role=one.role, options=one.options)
        return Seed(files={one.file: path.read_bytes()}, opened=one.file, role=one.role, options=one.options)


# -- how they are written ----------------------------------------------------------------------------------


def _samples() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(4)
    return rng.normal(size=(_N, 3)), rng.normal(size=(_N, 3))


def _npy(path: Path) -> None:
    np.save(path, np.column_stack(_samples()))


def _npz(path: Path) -> None:
    gyro, acc = _samples()
    np.savez(path, gyro=gyro, acc=acc, fs=100.0, units=np.array(["deg/s", "g"]))


def _csv(path: Path) -> None:
    rows = np.column_stack((np.arange(_N) / 100, *_samples()))
    head = "# rate: 100 Hz\ntime [s],gyro_x [deg/s],gyro_y [deg/s],gyro_z [deg/s],acc_x [g],acc_y [g],acc_z [g]\n"
    path.write_text(
        head + "".join(",".join(f"{v:.6g}" for v in row) + "\n" for row in rows), encoding="utf-8"
    )


def _european(path: Path) -> None:
    lines = [f"01.02.2020 10:00:{k:02d};{k};{np.sin(k):.5f}".replace("0.", "0,") for k in range(_N)]
    path.write_text("Datum;n;wx [°/s]\n" + "\n".join(lines) + "\n", encoding="cp1252")


def _document(path: Path) -> None:
    x, y, z = _samples()[0].T.tolist()
    t = [k / 100 for k in range(len(x))]
    path.write_text(json.dumps({"fs": 100, "log": {"t_s": t, "gyro": {"x": x, "y": y}, "acc": z}}))


def _labels(path: Path) -> None:
    rows = (
        f"T:{10 * k} GX:{x:.3f} GY[g]:{y:.3f} C: {z:.1f} C"
        for k, (x, y, z) in enumerate(_samples()[0].tolist())
    )
    path.write_text("\n".join(["ready", *rows]) + "\n", encoding="utf-8")


def _objects(path: Path) -> None:
    rows = (
        json.dumps({"t": k / 100, "gyro": {"x": x}, "acc": [y, z]})
        for k, (x, y, z) in enumerate(_samples()[0].tolist())
    )
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def _echoed(path: Path) -> None:
    messages = (
        f"header:\n  stamp:\n    sec: {k // 100}\n    nanosec: {k % 100 * 10**7}\nangular_velocity:\n"
        f"  x: {x}\n  y: {y}\ncovariance:\n- {z}\n- 0.0\n---\n"
        for k, (x, y, z) in enumerate(_samples()[0].tolist())
    )
    path.write_text("".join(messages), encoding="utf-8")


def _printed(path: Path) -> None:
    rows = (f"{k / 100}: [({x}, {y}), {z}]" for k, (x, y, z) in enumerate(_samples()[0].tolist()))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def _parts(path: Path) -> None:
    rows = (
        f"2024,2,{28 + k // 40},{k % 24},59,{k % 60},{k * 16},{v[0]:.3f},V"
        for k, v in enumerate(_samples()[0].tolist())
    )
    path.write_text(
        "year,month,day,hour,minute,second,ms,wx,unit\n" + "\n".join(rows) + "\n", encoding="utf-8"
    )


def _sentences(path: Path) -> None:
    bodies = [f"VNGYR,{x:+.5f},{y:+.5f},{z:+.5f}".encode() for x, y, z in _samples()[0]]
    bodies[10] = b"GPZDA,101010,01,02,2024,00,00"
    path.write_bytes(b"".join(b"$%s*%02X\r\n" % (b, functools.reduce(operator.xor, b)) for b in bodies))


def _packed(path: Path) -> None:
    _csv(path)
    path.write_bytes(gzip.compress(path.read_bytes(), mtime=0))


def _matlab5(path: Path) -> None:
    from scipy.io import savemat

    gyro, acc = _samples()
    savemat(path, {"gyro": gyro, "acc": acc, "fs": 100.0}, do_compression=True)


def _matlab5_plain(path: Path) -> None:
    from scipy.io import savemat

    gyro, acc = _samples()
    cells = np.array(["gx", "gy", "gz"], dtype=object)
    savemat(path, {"imu": {"gyro": gyro, "acc": acc, "fs": 100.0}, "columns": cells})


def _matlab73(path: Path) -> None:
    import h5py

    gyro, acc = _samples()
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("gyro", gyro.T), ("acc", acc.T), ("fs", [[100.0]])):
            file.create_dataset(name, data=values).attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")


def _hdf5(path: Path) -> None:
    import h5py

    gyro, acc = _samples()
    with h5py.File(path, "w") as file:
        group = file.create_group("imu")
        group.attrs["fs"] = 100.0
        group.create_dataset("gyro", data=gyro, chunks=(20, 3), compression="gzip").attrs["units"] = "deg/s"
        group.create_dataset("acc", data=acc, chunks=(20, 3), fletcher32=True)


def _tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        for part in np.array_split(np.column_stack(_samples()), 3):
            channels = [
                ChannelObject("IMU", f"c{i}", c, {"wf_increment": 0.01}) for i, c in enumerate(part.T)
            ]
            writer.write_segment(channels)


def _ardupilot(path: Path) -> None:
    gyro, acc = _samples()
    pieces = [logs.FMT_ITSELF, logs.fmt(*logs.IMU), logs.fmt(*logs.ISBH), logs.fmt(*logs.ISBD)]
    pieces += [logs.imu(10_000 * k, k % 2, gyro[k], acc[k]) for k in range(_N)]
    pieces.append(logs.record(logs.ISBH[0], logs.ISBH[2], [1, 0, 1, 0, 900, 32, 5, 1000.0]))
    pieces.append(logs.record(logs.ISBD[0], logs.ISBD[2], [1, 0, 0, *([list(range(32))] * 3)]))
    path.write_bytes(b"".join(pieces))


def _ulog(path: Path) -> None:
    gyro, acc = _samples()
    head = [logs.ulog_header(), logs.definition("sensor_combined", logs.SENSOR_COMBINED)]
    rows = [logs.combined(1, 10**7 + 4000 * k, gyro[k], acc[k]) for k in range(_N)]
    path.write_bytes(b"".join([*head, logs.subscription(1, "sensor_combined"), *rows, logs.dropout(20)]))


def _raw(path: Path) -> None:
    path.write_bytes(
        b"".join(b"\xa5\x5a" + row.astype("<f4").tobytes() for row in np.column_stack(_samples()))
    )


def _words(path: Path) -> None:
    path.write_text(
        "".join(
            "A55A " + row.astype("<f4").tobytes().hex(" ", 4) + "\n" for row in np.column_stack(_samples())
        ),
        encoding="utf-8",
    )


def _ros(two: bool, packed: str = "") -> Callable[[Path], None]:
    """An Imu, its temperature, and messages of another kind."""

    def written(path: Path) -> None:
        types, (gyro, acc) = ros.Types(two), _samples()
        rows = []
        for k in range(_N):
            at = 1_700_000_000 * 10**9 + 10_000_000 * k
            rows.append(("/imu/data", ros.IMU, at, types.imu(at, gyro[k], acc[k])))
            rows.append(("/imu/temperature", ros.TEMPERATURE, at, types.temperature(at, 20.0)))
            text = types.make("std_msgs/msg/String", data="hello")
            rows.append(("/chatter", "std_msgs/msg/String", at, text))
        ros.write(types, path, rows, packed)

    return written


def _ros_folder(path: Path) -> None:
    """A folder of ROS 2, with its metadata.yaml."""
    types, (gyro, acc) = ros.Types(True), _samples()
    rows = [("/imu", ros.IMU, 10**18 + k, types.imu(10**18 + 10**7 * k, gyro[k], acc[k])) for k in range(20)]
    ros.write(types, path.with_suffix(".mcap"), rows)
    folder = path.with_name(path.stem + "_folder")
    folder.rename(path)
    path.with_suffix(".mcap").rename(path / f"{path.stem}.mcap")


def _xlsx(path: Path) -> None:
    sheets.xlsx(path, {"log": _cells()})


def _ods(path: Path) -> None:
    sheets.ods(path, {"log": _cells()})


def _cells() -> list[Sequence[Any]]:
    gyro, acc = _samples()
    head = ["t (s)", *(f"{g} {a}" for g in ("gyro", "acc") for a in "xyz")]
    return [head, *([0.01 * k, *map(float, row)] for k, row in enumerate(np.column_stack((gyro, acc))))]


def _arrow(form: str, nested: bool = False) -> Callable[[Path], None]:
    def written(path: Path) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        gyro, acc = _samples()
        columns: dict[str, Any] = {"gyro_x": gyro[:, 0], "gyro_y": gyro[:, 1]}
        if nested:
            members = [dict(zip("xyz", map(float, row), strict=True)) for row in acc]
            columns = {"gyro": pa.array(gyro.tolist(), pa.list_(pa.float64())), "imu": pa.array(members)}
        table = pa.table({"t": np.arange(_N) / 100, **columns})
        table = table.replace_schema_metadata({"rate": "100"})
        if form == "parquet":
            pq.write_table(table, path, row_group_size=20)
            return
        opened = pa.ipc.new_file if form == "arrow" else pa.ipc.new_stream
        with opened(str(path), table.schema) as writer:
            writer.write_table(table, max_chunksize=20)

    return written


def _ours(path: Path) -> None:
    from allanite.files.readers import parquet
    from allanite.recording.records import Recording

    parquet.write(Recording.from_rate(_samples()[0], rate=100.0, unit="deg/s"), path)


def _run(path: Path) -> None:
    runs.write_run(path, (*range(0, 160, 32), *range(320, 480, 32)), rotate_bytes=8000)


def _compacted(path: Path) -> None:
    from allanite.files.store import compact

    folder = path.with_name("run")
    _run(folder)
    compact(folder, path)


_LAYOUT = """\
# 200 records a second
skip: 16
rate: 200
frame:
  header: "A5 5A"
  endian: little
  counter: {at: 2, type: u16}
  fields:
    - &usual {name: gyro_x, at: 4, type: i16, unit: deg/s, scale: 1.25e-4}
    - {<<: *usual, name: gyro_z, at: 14}
    - {name: gyro_y, at: 6, type: i24, missing: [0x7fffff]}
    - {name: temperature, type: f32, unit: degC, offset: 25}
"""
_DEVICE = """\
maker: none
model: made up
serial: "12"
rate: 200
sampling: mean
port: {baud: 115200}
frame:
  header: "A5 5A"
  length: 12
  endian: little
  counter: {at: 2, type: u16}
  checksum: {at: 10, kind: crc16-ccitt, from: 2, to: 9}
  fields:
    - {name: gyro_x, at: 4, type: i16, unit: deg/s, scale: 1.25e-4}
    - {name: acc_x, at: 6, type: f32, unit: g}
start:
  - {text: "go\\r\\n"}
identity: {ask: {text: "id?"}, answer: "(?P<serial>\\\\d+)"}
"""
_SHEET = """\
sensor: made up
source: page 3
gyro: {angle_random_walk: 0.3 deg/√h, bias_instability: 5 deg/h, bias_instability_is: minimum}
accelerometer: {velocity_random_walk: 0.03 m/s/√h}
"""
_KALIBR = """\
%YAML:1.0
accelerometer_noise_density: 0.01
accelerometer_random_walk: 2.0e-4
gyroscope_noise_density: 0.005
gyroscope_random_walk: 4.0e-6
rostopic: /imu0
update_rate: 200.0
"""
_MATLAB_JSON = {
    "SampleRate": 100,
    "Gyroscope": {
        "NoiseDensity": [1e-4, 1e-4, 2e-4],
        "BiasInstability": 1e-5,
        "BiasInstabilityCoefficients": {"Numerator": 1, "Denominator": [1, -0.9]},
        "NoiseType": "single-sided",
    },
    "Accelerometer": {"NoiseDensity": 1e-3},
}
_MODELS = {
    "gyro_x": {"terms": [{"type": "white", "N": 1e-4}, {"type": "random_walk", "K": 1e-6}], "kind": "rate"}
}


def _text(content: str) -> Callable[[Path], Any]:
    return lambda path: path.write_text(content, encoding="utf-8")


def _plain(content: Any) -> Callable[[Path], Any]:
    return _text(json.dumps(content, indent=1))


def _study(path: Path) -> None:
    from allanite.recording.records import Recording
    from allanite.study.characterization import characterize

    samples = np.random.default_rng(7).normal(size=(600, 1))
    recording = Recording.from_rate(samples, rate=10.0, unit="deg/s", names=["gyro_x"])
    characterize(recording).save(path)


def _saved_curve(path: Path) -> None:
    from allanite.noise.allan import allan_curve
    from allanite.recording.records import Recording

    samples = np.random.default_rng(7).normal(size=(300, 2))
    allan_curve(Recording.from_rate(samples, rate=10.0, unit="deg/s")).to_csv(path)


def _foreign_curve(path: Path) -> None:
    lags = 2 ** np.arange(9)
    rows = [f"{m / 10},{0.3 / np.sqrt(m)},{1001 - 2 * m}" for m in lags]
    path.write_text("tau,oadev,n\n" + "\n".join(rows) + "\n", encoding="utf-8")


def _phase(path: Path) -> None:
    np.savetxt(path, np.random.default_rng(7).normal(size=60), header="phase [ns]")


def _r_data(path: Path) -> None:
    columns = {"time": np.arange(_N) / 100.0, "gyro_x": np.random.default_rng(7).normal(size=_N)}
    path.write_bytes(
        r_writers.rda({"log": r_writers.frame(columns, "tbl_df"), "n": np.arange(3), "s": ["a", "b"]})
    )


_FIELDS = [{"name": f"gyro_{i}", "type": "f32"} for i in range(6)]
_RATE: Final[Json] = {"rate": 100.0}
_WORDS: Final[Json] = {
    "layout": {"rate": 100, "lines": {}, "frame": {"header": "A5 5A", "endian": "little", "fields": _FIELDS}}
}
_RECORDS: Final[Json] = {"layout": {"rate": 100, "frame": {"header": "A5 5A", "fields": _FIELDS}}}

FORMATS: Final[dict[str, Format]] = {
    "NumPy": Format(file="a.npy", write=_npy, options=_RATE, samples="numpy_file/*.npy"),
    "NumPy archive": Format(file="a.npz", write=_npz, options=_RATE, samples="numpy_file/*.npz"),
    "text": Format(file="a.csv", write=_csv, samples="text/fault0*"),
    "text, European": Format(file="b.csv", write=_european),
    "text, sentences": Format(file="c.txt", write=_sentences, options={"rate": 100.0, "variable": "VNGYR"}),
    "text, labels": Format(file="d.txt", write=_labels, samples="text/cells_*"),
    "text, objects": Format(file="e.json", write=_objects),
    "text, one document": Format(file="g.json", write=_document),
    "text, echoed messages": Format(file="h.txt", write=_echoed),
    "text, printed rows": Format(file="i.txt", write=_printed),
    "text, parts of a date": Format(file="f.csv", write=_parts),
    "text, packed": Format(file="a.csv.gz", write=_packed),
    "Parquet": Format(file="a.parquet", write=_arrow("parquet"), samples="parquet/*.parquet"),
    "Parquet of allanite": Format(file="b.parquet", write=_ours),
    "Arrow": Format(file="a.arrow", write=_arrow("arrow"), samples="parquet/*.feather"),
    "Parquet, nested": Format(file="c.parquet", write=_arrow("parquet", nested=True)),
    "Arrow, nested": Format(file="c.arrow", write=_arrow("arrow", nested=True)),
    "Arrow stream": Format(file="a.arrows", write=_arrow("stream"), samples="parquet/*.arrows"),
    "MATLAB 5": Format(file="a5.mat", write=_matlab5),
    "MATLAB 5, plain": Format(file="b5.mat", write=_matlab5_plain, samples="matlab/s*.mat matlab/vec*.mat"),
    "MATLAB 7.3": Format(file="a73.mat", write=_matlab73),
    "HDF5": Format(file="a.h5", write=_hdf5, samples="hdf5/*.h5"),
    "LabVIEW TDMS": Format(file="a.tdms", write=_tdms, samples="tdms/*.tdms"),
    "ArduPilot": Format(file="a.BIN", write=_ardupilot, samples="ardupilot/*.BIN"),
    "PX4 ULog": Format(file="a.ulg", write=_ulog, samples="ulog/*.ulg"),
    "MAVLink": Format(file="a.tlog", write=lambda path: path.write_bytes(mavlink_writer.telemetry(2))),
    "R": Format(file="a.rda", write=_r_data),
    "R, packed": Format(
        file="b.rda", write=lambda path: (_r_data(path), path.write_bytes(gzip.compress(path.read_bytes())))
    ),
    "ROS 1 bag": Format(file="a1.bag", write=_ros(False), samples="rosbag/*.bag"),
    "ROS 1 bag, lz4": Format(file="a2.bag", write=_ros(False, "lz4")),
    "ROS 2 SQLite": Format(file="a.db3", write=_ros(True), samples="rosbag/*.db3"),
    "MCAP": Format(file="a1.mcap", write=_ros(True)),
    "MCAP, zstd": Format(file="a2.mcap", write=_ros(True, "storage")),
    "ROS 2 folder": Format(file="recorded", write=_ros_folder),
    "spreadsheet": Format(file="a.xlsx", write=_xlsx, options=_RATE),
    "spreadsheet, OpenDocument": Format(file="a.ods", write=_ods, options=_RATE),
    "raw binary": Format(file="a.raw", write=_raw, options=_RECORDS),
    "hexadecimal words": Format(file="a.txt", write=_words, options=_WORDS),
    "layout": Format(file="a.yaml", write=_text(_LAYOUT), role="raw"),
    "description of a device": Format(file="d.yaml", write=_text(_DEVICE), role="device"),
    "data sheet": Format(file="s.yaml", write=_text(_SHEET), role="datasheet"),
    "imu.yaml of Kalibr": Format(file="imu.yaml", write=_text(_KALIBR), role="model"),
    "parameters of MATLAB": Format(file="p.json", write=_plain(_MATLAB_JSON), role="model"),
    "models": Format(file="m.json", write=_plain(_MODELS), role="model"),
    "curve": Format(file="allan.csv", write=_saved_curve, role="curve"),
    "curve of another program": Format(file="curve.csv", write=_foreign_curve, role="curve"),
    "phase of a clock": Format(file="phase.txt", write=_phase, role="clock"),
    "study": Format(file="study.json", write=_study, role="study"),
    "run": Format(file="run", write=_run, role="run"),
    "run, compacted": Format(file="c.parquet", write=_compacted, samples="run/*.parquet"),
}
"""Every format that is read, by its name."""
