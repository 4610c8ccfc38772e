# SPDX-License-Identifier: BSD-3-Clause
"""Make the binary samples beside this script: ``python tests/samples/make_binary_samples.py``.

The numbers are the same in all of them (``gyro`` and ``acc`` below), so that all readers must give one result.
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import flight_log_writers as logs  # noqa: E402  (it stands beside the tests)
import r_writers  # noqa: E402
import spreadsheet_writers as sheets  # noqa: E402

N = 40
STAMPS = 1_700_000_000_000_000_000 + np.arange(N, dtype=np.int64) * 10_000_000
T = np.arange(N) * 0.01
GYRO = np.round(np.sin(np.arange(3 * N).reshape(N, 3)), 6)
ACC = np.round(np.cos(np.arange(3 * N).reshape(N, 3)) + [0, 0, 9.8], 6)
KINDS = ["rate"] * 3 + ["acceleration"] * 3
SI = ["rad/s"] * 3 + ["m/s²"] * 3
TRIADS = [f"{g}_{a}" for g in ("gyro", "acc") for a in "xyz"]


def channels(names: list[str], gyro: str = "", acc: str = "") -> list[dict[str, str]]:
    kinds = {"gyro": "rate" if gyro else "unknown", "acc": "acceleration" if acc else "unknown"}
    units = {"gyro": gyro, "acc": acc}
    return [
        {"name": n, "kind": kinds.get(n.split("_")[0], "unknown"), "unit": units.get(n.split("_")[0], "")}
        for n in names
    ]


def folder(name: str) -> Path:
    place = HERE / name
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    return place


def save(place: Path, expected: dict[str, Any]) -> None:
    text = json.dumps(expected, indent=1, ensure_ascii=False)
    (place / "expected.json").write_text(text + "\n", encoding="utf-8")


def first(*columns: Any) -> list[float]:
    return [float(v) for c in columns for v in np.atleast_1d(c[0])]


def numpy_file() -> None:
    place = folder("numpy_file")
    np.save(place / "table.npy", GYRO)
    np.save(place / "fortran_big_endian.npy", np.asfortranarray(GYRO).astype(">f4"))
    np.save(place / "counts.npy", (1000 * GYRO[:, 0]).astype(np.int16))
    np.save(place / "cube.npy", np.zeros((2, 3, 4)))
    np.save(place / "pickle.npy", np.array([{}], dtype=object), allow_pickle=True)
    np.savez(place / "named.npz", t=T, gyro_deg_s=GYRO, acc_m_s2=ACC)
    labels = np.array(["gx", "gy", "gz"])
    np.savez_compressed(place / "labelled.npz", data=GYRO, columns=labels, units="deg/s", fs=100.0)
    fields = np.zeros(N, dtype=[("timestamp_ns", "i8"), ("wx", "f4")])
    fields["timestamp_ns"], fields["wx"] = STAMPS, GYRO[:, 0]
    np.save(place / "fields.npy", fields)
    plain = channels(["ch0", "ch1", "ch2"])
    save(
        place,
        {
            "table.npy": {
                "options": {"rate": 100},
                "rate": 100,
                "samples": N,
                "channels": plain,
                "first": first(GYRO),
            },
            "fortran_big_endian.npy": {
                "options": {"rate": 100},
                "rate": 100,
                "samples": N,
                "channels": plain,
                "dtype": ">f4",
                "first": first(GYRO.astype("f4")),
            },
            "counts.npy": {
                "options": {"rate": 100, "unit": "LSB", "scale_factor": "131 LSB/(deg/s)"},
                "rate": 100,
                "samples": N,
                "channels": [{"name": "ch0", "kind": "rate", "unit": "LSB"}],
                "dtype": "int16",
            },
            "cube.npy": {"options": {"rate": 100}, "error": "InputError", "match": r"\(2, 3, 4\)"},
            "pickle.npy": {"error": "FormatError", "match": "pickle"},
            "named.npz": {
                "rate": 100,
                "samples": N,
                "channels": channels(TRIADS, "deg/s", "m/s²"),
                "first": first(GYRO, ACC),
                "timebase": {"source": "t", "unit": "s"},
            },
            "labelled.npz": {
                "rate": 100,
                "samples": N,
                "channels": [{"name": n, "kind": "rate", "unit": "deg/s"} for n in ("gx", "gy", "gz")],
                "first": first(GYRO),
                "source": {"units_from": "metadata"},
                "timebase": {"source": "array 'fs'"},
            },
            "fields.npy": {
                "rate": 100,
                "samples": N,
                "channels": [{"name": "wx", "kind": "unknown", "unit": ""}],
                "start": int(STAMPS[0]),
                "timebase": {"unit": "ns"},
            },
        },
    )


def parquet() -> None:
    import pyarrow as pa
    import pyarrow.feather
    import pyarrow.parquet as pq

    place = folder("parquet")
    columns = {"time": pa.array(STAMPS).cast(pa.timestamp("ns"))}
    fields = [pa.field("time", pa.timestamp("ns"))]
    for k, name in enumerate(TRIADS):
        columns[name] = pa.array((GYRO, ACC)[k // 3][:, k % 3])
        unit = "deg/s" if k < 3 else "m/s²"
        fields.append(pa.field(name, pa.float64(), metadata={"unit": unit}))
    table = pa.table(columns, schema=pa.schema(fields))
    pq.write_table(table, place / "units_in_fields.parquet", row_group_size=16)
    pa.feather.write_feather(table, place / "compressed.feather", compression="zstd")
    with pa.ipc.new_stream(str(place / "stream.arrows"), table.schema) as writer:
        writer.write_table(table, max_chunksize=16)
    counts = pa.array([None if k == 3 else 32768 + k % 5 for k in range(N)], pa.int32())
    bare = pa.table({"gyro_z (LSB)": counts}).replace_schema_metadata({"rate": "50"})
    pq.write_table(bare, place / "counts_with_null.parquet")
    (place / "cut.parquet").write_bytes((place / "units_in_fields.parquet").read_bytes()[:-200])
    whole = {
        "rate": 100,
        "samples": N,
        "channels": channels(TRIADS, "deg/s", "m/s²"),
        "first": first(GYRO, ACC),
        "start": int(STAMPS[0]),
    }
    save(
        place,
        {
            "units_in_fields.parquet": whole,
            "compressed.feather": whole,
            "stream.arrows": whole,
            "counts_with_null.parquet": {
                "rate": 50,
                "samples": N,
                "channels": [{"name": "gyro_z", "kind": "counts", "unit": "LSB"}],
                "missing": {"gyro_z": 1},
                "dtype": "int32",
            },
            "cut.parquet": {"error": "FormatError", "match": "damaged or incomplete"},
        },
    )


def matlab() -> None:
    from scipy.io import savemat

    place = folder("matlab")
    savemat(place / "vectors.mat", {"t": T, "gyro_deg_s": GYRO, "acc_m_s2": ACC}, do_compression=True)
    savemat(
        place / "structure.mat", {"imu": {"fs": 100.0, "gyro": GYRO, "acc": ACC}, "other": np.ones((20, 2))}
    )
    savemat(place / "words_only.mat", {"note": "nothing to see"})
    with h5py.File(place / "version73.mat", "w", userblock_size=512) as file:
        for name, values in (("t", T), ("gyro_deg_s", GYRO), ("acc_m_s2", ACC)):
            variable = file.create_dataset(
                name, data=np.atleast_2d(values).T if values.ndim > 1 else [values]
            )
            variable.attrs["MATLAB_class"] = np.bytes_("double")
    with (place / "version73.mat").open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
    save(
        place,
        {
            "vectors.mat": {
                "rate": 100,
                "samples": N,
                "channels": channels(TRIADS, "deg/s", "m/s²"),
                "first": first(GYRO, ACC),
            },
            "structure.mat": {
                "options": {"variable": "imu", "unit": {"gyro": "deg/s"}},
                "rate": 100,
                "samples": N,
                "channels": channels(TRIADS, "deg/s"),
                "first": first(GYRO, ACC),
                "timebase": {"source": "array 'fs'"},
            },
            "words_only.mat": {"error": "InputError", "match": "no array of samples"},
            "version73.mat": {
                "rate": 100,
                "samples": N,
                "channels": channels([f"{g}_{x}" for g in ("acc", "gyro") for x in "xyz"], "deg/s", "m/s²"),
                "first": first(ACC, GYRO),
            },
        },
    )


def rosbag() -> None:
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    place = folder("rosbag")
    nested = "std_msgs/Header header\nsensor_msgs/Imu imu\nfloat64 temperature\n"

    def messages(store: Any, topic_type: str, one: bool) -> list[tuple[int, Any]]:
        kinds = store.types
        vector, quaternion = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Quaternion"]
        result = []
        for k in range(N):
            stamp = kinds["builtin_interfaces/msg/Time"](*(int(v) for v in divmod(STAMPS[k], 10**9)))
            seq = {"seq": k} if one else {}
            header = kinds["std_msgs/msg/Header"](**seq, stamp=stamp, frame_id="imu link" if k != 7 else "x")
            imu = kinds["sensor_msgs/msg/Imu"](
                header=header,
                orientation=quaternion(0.0, 0.0, 0.0, 1.0),
                orientation_covariance=np.zeros(9),
                angular_velocity=vector(*map(float, GYRO[k])),
                angular_velocity_covariance=np.zeros(9),
                linear_acceleration=vector(*map(float, ACC[k])),
                linear_acceleration_covariance=np.zeros(9),
            )
            if topic_type != "sensor_msgs/msg/Imu":
                imu = kinds[topic_type](header=header, imu=imu, temperature=20.0)
            result.append((int(STAMPS[k]) + 500_000 * (k % 3), imu))
        return result

    one, two = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
    for store in (one, two):
        store.register(get_types_from_msg(nested, "maker_msgs/msg/Sensor"))
    for file, topic, kind in (
        ("imu with blank.bag", "/imu/data_raw", "sensor_msgs/msg/Imu"),
        ("nested.bag", "/sensor", "maker_msgs/msg/Sensor"),
    ):
        with Writer1(place / file) as bag:
            connection = bag.add_connection(topic, kind, typestore=one)
            for when, message in messages(one, kind, True):
                bag.write(connection, when, one.serialize_ros1(message, kind))
    with Writer1(place / "no_imu.bag") as bag:
        connection = bag.add_connection("/chatter", "std_msgs/msg/String", typestore=one)
        text = one.types["std_msgs/msg/String"](data="hello")
        bag.write(connection, 1, one.serialize_ros1(text, "std_msgs/msg/String"))
    for name, plugin in (("sqlite3", StoragePlugin.SQLITE3), ("mcap", StoragePlugin.MCAP)):
        with Writer2(place / name, version=9, storage_plugin=plugin) as bag:
            kind = "sensor_msgs/msg/Imu"
            connection = bag.add_connection("/imu/data_raw", kind, typestore=two)
            for when, message in messages(two, kind, False):
                bag.write(connection, when, two.serialize_cdr(message, kind))
    shutil.move(place / "sqlite3" / "sqlite3.db3", place / "bare.db3")
    shutil.rmtree(place / "sqlite3")
    whole = {
        "rate": 100,
        "samples": N,
        "channels": channels(TRIADS, "rad/s", "m/s²"),
        "first": first(GYRO, ACC),
        "start": int(STAMPS[0]),
        "source": {"topic": "/imu/data_raw"},
        "timebase": {"source": "stamp", "unit": "ns"},
    }
    save(
        place,
        {
            "imu with blank.bag": whole,
            "bare.db3": whole,
            "mcap": whole,
            "nested.bag": whole | {"source": {"topic": "/sensor"}},
            "no_imu.bag": {"error": "InputError", "match": r"/chatter \(std_msgs"},
        },
    )


def run() -> None:
    from dataclasses import replace

    from allanite.files.store import Batch, Header, LogStore, compact
    from allanite.recording.records import Channel

    place = folder("run")
    names = [n for n in TRIADS if n.startswith("gyro")]
    header = Header(
        channels=tuple(Channel.of(n, "deg/s") for n in names),
        rate=100.0,
        instrument={"model": "made up", "serial": "12"},
        settings={"range": 250},
    )

    def batch(a: int, b: int) -> Batch:
        """Samples a to b, five of which are missing before the twentieth."""
        counter = np.arange(a, b) + 5 * (a >= 20)
        clock = counter * 10_000_000
        return Batch(
            counter=counter,
            monotonic_ns=clock,
            values=GYRO[a:b],
            flags=np.zeros(b - a, dtype=np.uint8),
            utc_ns=int(STAMPS[0] + clock[-1]),
        )

    with LogStore.create(place / "finished", header, rotate_bytes=3000) as store:
        for a in range(0, N, 10):
            store.append(batch(a, a + 10))
    compact(place / "finished", place / "compacted.parquet")
    with LogStore.create(place / "changed", header) as store:
        store.append(batch(0, 20))
        store.change(replace(header, settings={"range": 500}))
        store.append(batch(20, 40))
    shutil.copytree(place / "finished", place / "cut")
    cut = max((place / "cut").glob("*.arrows"))
    cut.write_bytes(cut.read_bytes()[:-100])
    (place / "cut" / "manifest.jsonl").unlink()
    facts = {"rate": 100, "channels": channels(names, "deg/s"), "start": int(STAMPS[0])}
    whole = {**facts, "samples": 45, "first": first(GYRO[:, 0], GYRO[:, 1], GYRO[:, 2])}
    whole["missing"] = dict.fromkeys(names, 5)
    message = "000002.arrows \\(settings.range: 250 → 500\\)"
    save(
        place,
        {
            "finished": {**whole, "source": {"status": "success", "gaps": 1}},
            "compacted.parquet": {**whole, "source": {"status": "success", "gaps": 1}},
            "cut": {**whole, "samples": 35, "source": {"status": "unfinished"}, "guess": "the recorder died"},
            "changed": {"error": "DataQualityError", "match": message},
        },
    )


def ardupilot() -> None:
    place = folder("ardupilot")
    stamps = [10**6 + 10_000 * k for k in range(N)]
    rows = [logs.imu(at, 0, GYRO[k], ACC[k], T=40.0) for k, at in enumerate(stamps)]
    (place / "imu.BIN").write_bytes(logs.FMT_ITSELF + logs.fmt(*logs.IMU) + b"".join(rows))
    (place / "without.BIN").write_bytes(logs.FMT_ITSELF + logs.fmt(201, "MSG", "QZ", "TimeUS,Message"))
    names = [f"{g}{x}" for g in ("Gyr", "Acc") for x in "XYZ"]
    found = [{"name": n, "kind": k, "unit": u} for n, k, u in zip(names, KINDS, SI, strict=True)]
    found.append({"name": "temperature", "kind": "temperature", "unit": "°C"})
    save(
        place,
        {
            "imu.BIN": {
                "rate": 100,
                "samples": N,
                "channels": found,
                "dtype": "float32",
                "first": [*first(GYRO.astype("f4"), ACC.astype("f4")), 40.0],
                "source": {"topic": "IMU[0]", "bytes_skipped": 0},
            },
            "without.BIN": {"error": "InputError", "match": "no message of an inertial sensor"},
        },
    )


def ulog() -> None:
    place = folder("ulog")
    rows = [logs.combined(1, 10**7 + 10_000 * k, GYRO[k], ACC[k]) for k in range(N)]
    head = logs.ulog_header(10**7) + logs.definition("sensor_combined", logs.SENSOR_COMBINED)
    (place / "combined.ulg").write_bytes(head + logs.subscription(1, "sensor_combined") + b"".join(rows))
    found = [{"name": n, "kind": k, "unit": u} for n, k, u in zip(TRIADS, KINDS, SI, strict=True)]
    save(
        place,
        {
            "combined.ulg": {
                "rate": 100,
                "samples": N,
                "channels": found,
                "dtype": "float32",
                "first": first(GYRO.astype("f4"), ACC.astype("f4")),
                "source": {"topic": "sensor_combined[0]", "dropouts": 0},
            },
        },
    )


def mavlink() -> None:
    from pymavlink.dialects.v20 import common

    place, sender = folder("mavlink"), common.MAVLink(None, srcSystem=1, srcComponent=1)
    content = b""
    for k in range(N):
        sample = common.MAVLink_highres_imu_message(
            10**7 + 10_000 * k, *ACC[k], *GYRO[k], *[0.0] * 6, 25.0, 63
        )
        content += (int(STAMPS[k]) // 1000).to_bytes(8, "big") + bytes(sample.pack(sender))
    (place / "telemetry.tlog").write_bytes(content)
    found = [{"name": n, "kind": k, "unit": u} for n, k, u in zip(TRIADS, KINDS, SI, strict=True)]
    found.append({"name": "temperature", "kind": "temperature", "unit": "°C"})
    save(
        place,
        {
            "telemetry.tlog": {
                "rate": 100,
                "samples": N,
                "channels": found,
                "first": [*first(GYRO.astype("f4"), ACC.astype("f4")), 25.0],
                "source": {"topic": "HIGHRES_IMU"},
            },
        },
    )


def r_data() -> None:
    place = folder("r_data")
    columns = {"t": T, **dict(zip(TRIADS, np.hstack([GYRO, ACC]).T, strict=True))}
    frame = r_writers.frame(columns)
    (place / "frame.rds").write_bytes(r_writers.rds(frame))
    (place / "workspace.rda").write_bytes(r_writers.rda({"note": np.arange(3.0), "imu": frame}))
    entry = {"rate": 100, "samples": N, "channels": channels(TRIADS), "first": first(GYRO, ACC)}
    save(place, {"frame.rds": entry, "workspace.rda": entry})


def tdms() -> None:
    from nptdms import ChannelObject, TdmsWriter

    place = folder("tdms")
    wave = {"wf_increment": 0.01}
    with TdmsWriter(place / "waveform.tdms") as writer:
        columns = zip(TRIADS, np.column_stack((GYRO, ACC)).T, ["deg/s"] * 3 + ["m/s^2"] * 3, strict=True)
        writer.write_segment([ChannelObject("IMU", n, c, {**wave, "unit_string": u}) for n, c, u in columns])
    save(
        place,
        {
            "waveform.tdms": {
                "rate": 100,
                "samples": N,
                "channels": channels(TRIADS, "deg/s", "m/s^2"),
                "first": first(GYRO, ACC),
                "source": {"group": "IMU"},
                "timebase": {"source": "property wf_increment"},
            },
        },
    )


def hdf5() -> None:
    place = folder("hdf5")
    with h5py.File(place / "group.h5", "w") as file:
        group = file.create_group("imu")
        group.attrs["sample_rate"] = 100.0
        group.create_dataset("acc", data=ACC).attrs["units"] = "m/s²"
        group.create_dataset("gyro", data=GYRO, chunks=(16, 3), compression="gzip").attrs["units"] = "deg/s"
    with h5py.File(place / "outside.h5", "w") as file:
        file["x"] = h5py.ExternalLink("group.h5", "/imu/acc")
    save(
        place,
        {
            "group.h5": {
                "rate": 100,
                "samples": N,
                "channels": channels([f"{g}_{x}" for g in ("acc", "gyro") for x in "xyz"], "deg/s", "m/s²"),
                "first": first(ACC, GYRO),
                "source": {"group": "/imu"},
            },
            "outside.h5": {"error": "FormatError", "match": "leads out of itself"},
        },
    )


def raw_binary() -> None:
    place = folder("raw_binary")
    (place / "float32.bin").write_bytes(GYRO.astype(">f4").tobytes())
    fields = [{"name": f"gyro_{x}", "type": "f32", "unit": "deg/s"} for x in "xyz"]
    save(
        place,
        {
            "float32.bin": {
                "options": {"layout": {"rate": 100, "frame": {"endian": "big", "fields": fields}}},
                "rate": 100,
                "samples": N,
                "channels": channels([f"gyro_{x}" for x in "xyz"], "deg/s"),
                "dtype": "float32",
                "first": first(GYRO.astype("f4")),
            },
        },
    )


def spreadsheet() -> None:
    place = folder("spreadsheet")
    head = ["Time (s)", *(f"{n} ({u})" for n, u in zip(TRIADS, SI, strict=True))]
    rows = [[float(v) for v in row] for row in np.column_stack((T, GYRO, ACC))]
    notes = [["Run", "Remark"], ["1", "at rest"]]
    sheets.xlsx(place / "workbook.xlsx", {"Notes": notes, "Log": [["SN: 12"], [], head, *rows]})
    sheets.ods(place / "workbook.ods", {"Log": [head, *rows]})
    (place / "cut.xlsx").write_bytes((place / "workbook.xlsx").read_bytes()[:2000])
    whole = {
        "rate": 100,
        "samples": N,
        "channels": channels(TRIADS, "rad/s", "m/s²"),
        "first": first(GYRO, ACC),
        "source": {"format": "spreadsheet", "sheet": "Log"},
        "timebase": {"source": "Time", "unit": "s"},
    }
    numbered = {
        **whole,
        "source": {**whole["source"], "serial": "12"},
        "guess": "several sheets: Log was read",
    }
    save(
        place,
        {
            "workbook.xlsx": numbered,
            "workbook.ods": whole,
            "cut.xlsx": {"error": "FormatError", "match": "damaged spreadsheet"},
        },
    )


if __name__ == "__main__":
    numpy_file()
    parquet()
    matlab()
    rosbag()
    run()
    ardupilot()
    ulog()
    mavlink()
    r_data()
    tdms()
    hdf5()
    raw_binary()
    spreadsheet()
