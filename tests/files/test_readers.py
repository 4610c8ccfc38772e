# SPDX-License-Identifier: BSD-3-Clause
"""`read`: one result whatever the container, what the caller may say, and real recordings."""

from __future__ import annotations

import itertools
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from allanite.errors import DataQualityError, FormatError, InputError
from allanite.files.readers import parquet, read
from allanite.files.readers.delimited import cells, streams
from allanite.files.readers.delimited.dates import date_format, to_nanoseconds
from allanite.files.readers.delimited.preamble import facts_in, rate_in
from allanite.files.readers.headings import read_heading
from allanite.recording.health.examination import check
from allanite.recording.records import Kind, Recording

N = 500
T = np.arange(N) * 0.01
RNG = np.random.default_rng(12)
GYRO = RNG.normal(size=(N, 3))
ACC = RNG.normal(size=(N, 3)) + [0, 0, 9.8]
NAMES = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
UNITS = ("deg/s",) * 3 + ("m/s²",) * 3


def csv_text(rows: slice = slice(None), order: tuple[int, ...] = tuple(range(6)), sep: str = ",") -> str:
    header = sep.join(["t (s)", *(f"{NAMES[i]} ({UNITS[i]})" for i in order)])
    table = np.column_stack((T, GYRO, ACC))[rows]
    lines = [sep.join(repr(float(row[k])) for k in (0, *(i + 1 for i in order))) for row in table]
    return "\n".join([header, *lines, ""])


def same(a: Recording, b: Recording) -> bool:
    return (
        a.rate == b.rate
        and a.names == b.names
        and [(c.kind, c.unit, c.scale) for c in a.channels] == [(c.kind, c.unit, c.scale) for c in b.channels]
        and all(np.array_equal(a.values(n), b.values(n), equal_nan=True) for n in a.names)
    )


# -- one result ----------------------------------------------------------------------------------------------


@pytest.mark.long
def test_m12_every_container_gives_the_same_bits(tmp_path: Path) -> None:
    import gzip

    import pyarrow as pa
    import pyarrow.feather
    import pyarrow.parquet as pq
    from scipy.io import savemat

    columns = dict(zip(("t", *NAMES), np.column_stack((T, GYRO, ACC)).T, strict=True))
    units = dict(zip(NAMES, UNITS, strict=True))
    files = [tmp_path / f"a.{s}" for s in ("csv", "tsv", "csv.gz", "npz", "parquet", "feather", "mat", "npy")]
    files[0].write_text(csv_text(), encoding="utf-8")
    files[1].write_text(csv_text(sep="\t").replace("m/s²", "m/s^2"), encoding="utf-16")
    files[2].write_bytes(gzip.compress(csv_text().encode()))
    np.savez(files[3], **columns)
    table = pa.table({k: np.ascontiguousarray(v) for k, v in columns.items()})
    pq.write_table(table, files[4], row_group_size=64)
    pa.feather.write_feather(table, files[5], compression="zstd")
    savemat(files[6], columns, do_compression=True)
    for order in "<>":
        fields = np.array(
            [tuple(r) for r in np.column_stack((T, GYRO, ACC))], [(k, f"{order}f8") for k in columns]
        )
        np.save(files[7], fields)
        files.append(files[7].rename(tmp_path / f"order{ord(order)}.npy"))
    files.remove(files[7])
    first = read(files[0])
    assert first.rate == 100.0
    for file in files[1:]:
        other = read(file, unit=units)
        assert [c.scale for c in other.channels] == [c.scale for c in first.channels], file.name
        assert same(first, read(file, unit=units)) or ".tsv" in file.name, file.name
        assert all(np.array_equal(other.values(n), first.values(n)) for n in NAMES), file.name


def test_m11_two_files_are_one_in_any_order(tmp_path: Path) -> None:
    whole, early, late = (tmp_path / f"{n}.csv" for n in ("whole", "early", "late"))
    whole.write_text(csv_text(), encoding="utf-8")
    early.write_text(csv_text(slice(0, 200)), encoding="utf-8")
    late.write_text(csv_text(slice(200, N), order=(5, 4, 3, 2, 1, 0)), encoding="utf-8")
    joined = read([early, late])
    assert same(joined, read(whole))
    again = read([late, early], channels=list(NAMES))
    assert same(again.select(*joined.names), joined)
    late.write_text(csv_text(slice(230, N)), encoding="utf-8")
    gap = read([early, late])
    assert gap.n_samples == N
    assert np.isnan(gap.values("gyro_x")[200:230]).all()
    assert np.array_equal(gap.values("acc_z")[230:], ACC[230:, 2])
    late.write_text(csv_text(slice(190, N)), encoding="utf-8")
    with pytest.raises(InputError, match="overlap"):
        read([early, late])
    late.write_text("t,wx\n0.0,1\n0.1,2\n")
    with pytest.raises(InputError, match="columns"):
        read([early, late])
    np.save(tmp_path / "a.npy", GYRO)
    with pytest.raises(InputError, match="without time"):
        read([tmp_path / "a.npy", tmp_path / "a.npy"], rate=1)
    with pytest.raises(InputError, match="no file"):
        read([])


def test_chunks_of_any_size_give_the_same_columns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.csv"
    path.write_text(csv_text(), encoding="utf-8")
    expected = read(path)
    for size in (300, 1000, 4096):
        monkeypatch.setattr(streams, "_PIECE", size)
        assert same(read(path), expected)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_blank_lines_anywhere_do_not_matter_for_any_chunk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, end: str
) -> None:
    rows = [f"{k / 8},{k}.5{end}" + end * (k % 7 == 0) * (k % 5) for k in range(60)]
    for tail, unfinished in ((end * 9, False), ("", False), (end * 4 + "7.5,3", True)):
        (tmp_path / "a.csv").write_bytes(f"t,wx{end}{''.join(rows)}{tail}".encode())
        for size in (5, 11, 64, 1000):
            monkeypatch.setattr(streams, "_PIECE", size)
            recording = read(tmp_path / "a.csv")
            assert np.array_equal(recording.values("wx"), np.arange(60) + 0.5), size
            assert recording.notes["text"]["unterminated_last_line"] is unfinished


def test_cell_by_cell_equals_the_fast_parser(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.csv"
    path.write_text(csv_text(), encoding="utf-8")
    expected = read(path)
    monkeypatch.setattr(cells.TextColumns, "_fast", lambda self, piece: None)
    assert same(read(path), expected)


@settings(max_examples=40)
@given(st.lists(st.floats(allow_nan=True, allow_infinity=False, width=64), min_size=12, max_size=40))
def test_f11_floats_survive_as_text(tmp_path_factory: pytest.TempPathFactory, values: list[float]) -> None:
    values = [v for v in values if abs(v) < 9e37 or v != v]
    if sum(v == v for v in values) < 5:
        return
    path = tmp_path_factory.mktemp("floats") / "a.csv"
    path.write_text("t,wx\n" + "".join(f"{k * 0.5!r},{v!r}\n" for k, v in enumerate(values)))
    found = read(path).values("wx")
    assert np.array_equal(found, values, equal_nan=True)


def test_b8_integers_of_every_width_keep_their_type_and_value(tmp_path: Path) -> None:
    base = 2**62
    for dtype in ("int16", "uint16", "int32", "int64", "float16", "float32"):
        values = (np.arange(50) % 7 + (base if dtype == "int64" else 0)).astype(dtype)
        np.save(tmp_path / "a.npy", values)
        recording = read(tmp_path / "a.npy", rate=1, unit="LSB")
        assert recording.columns[0].dtype == dtype
        assert np.array_equal(recording.values("ch0"), np.arange(50) % 7)
        assert recording.origin("ch0") == (base if dtype == "int64" else 0)
    (tmp_path / "a.csv").write_text("wx,wy\n" + "".join(f"{base + k % 7},{k}.5\n" for k in range(50)))
    recording = read(tmp_path / "a.csv", rate=1)
    assert np.array_equal(recording.values("wx"), np.arange(50) % 7)
    assert recording.columns[0].dtype == np.int64


def test_whole_numbers_become_floats_where_a_decimal_turns_up_late(tmp_path: Path) -> None:
    rows = ["5"] * 40_000 + ["5.5"] + ["+6"] * 10
    (tmp_path / "a.csv").write_text("t,wx\n" + "".join(f"{k * 0.5},{v}\n" for k, v in enumerate(rows)))
    values = read(tmp_path / "a.csv").values("wx")
    assert np.array_equal(values, [float(v) for v in rows])


# -- what the caller may say ---------------------------------------------------------------------------------


@pytest.fixture
def six(tmp_path: Path) -> Path:
    """Six axes without units, with time."""
    path = tmp_path / "six.csv"
    text = "t,gx,gy,gz,ax,ay,az,temp,mx\n"
    path.write_text(text + "".join(f"{k / 10},{k % 3},1,2,3,4,5,20,7\n" for k in range(20)))
    return path


def kinds(recording: Recording) -> str:
    letters = {
        Kind.RATE: "w",
        Kind.ACCELERATION: "a",
        Kind.UNKNOWN: "?",
        Kind.TEMPERATURE: "T",
        Kind.OTHER: ".",
        Kind.COUNTS: "c",
    }
    return "".join(letters[c.kind] for c in recording.channels)


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        (None, "??????T."),
        ({"gyro": "deg/s", "acc": "g"}, "wwwaaaT."),
        ({"w": "deg/s", "accelerometer": "g"}, "wwwaaaT."),
        ({"gx": "deg/s"}, "w?????T."),
        ({"a": "m/s²", "ax": "LSB"}, "???caaT."),
        ({"g": "rad/s", "temp": "°C", "mx": "uT"}, "www???T."),
        ("deg/s", "www???T."),
        ("unknown", "??????T."),
        ("LSB", "ccccccT."),
    ],
)
def test_units_by_name_group_or_for_all(six: Path, unit: Any, expected: str) -> None:
    assert kinds(read(six, unit=unit)) == expected


def test_units_that_cannot_be_meant(six: Path) -> None:
    with pytest.raises(InputError, match="fits none"):
        read(six, unit="Pa")
    for meant in ("V/√Hz", "deg/√h", {"gx": "deg/√h"}, "mg/√Hz", "LSB/(deg/s)"):
        with pytest.raises(InputError, match=r"not of samples: did you mean (V|deg/s|m/s²|LSB)"):
            read(six, unit=meant)
    with pytest.raises(InputError, match=r"channel ax: unit 'deg/foo'.*nearest: foot"):
        read(six, unit={"acc": "deg/foo"})
    with pytest.raises(InputError, match=r"'volt'.*no such channel"):
        read(six, unit={"volt": "V"})
    with pytest.raises(InputError, match="text or a mapping"):
        read(six, unit=3)  # type: ignore[arg-type]


def test_scale_factors_turn_counts_and_volts_into_rates(six: Path) -> None:
    recording = read(six, scale_factor={"gyro": "131 LSB/(deg/s)", "acc": "16384 LSB/g"})
    assert kinds(recording) == "wwwaaaT."
    assert recording["gx"].unit == "LSB"
    assert recording["gx"].scale == pytest.approx(np.radians(1) / 131)
    volts = read(six, channels=["gx"], unit="mV", scale_factor="24.0 mV/(deg/s)")
    assert volts["gx"].scale == pytest.approx(np.radians(1) / 24)
    assert kinds(read(six, scale_factor="131 LSB/(deg/s)")) == "www???T."
    with pytest.raises(InputError, match=r"channel gx.*samples are"):
        read(six, unit={"gyro": "V"}, scale_factor={"gyro": "131 LSB/(deg/s)"})


def test_channels_are_chosen_by_name_heading_or_group(six: Path) -> None:
    assert read(six, channels=["gyro", "az"]).names == ("gx", "gy", "gz", "az")
    assert read(six, channels="temp").names == ("temp",)
    path = six.with_name("euroc.csv")  # names that say nothing, units that do
    path.write_text("#timestamp [ns],w_RS_S_x [rad s^-1],a_RS_S_x [m s^-2]\n" + "".join(
        f"{1403636579758555392 + 5_000_000 * i},0.{i},9.{i}\n" for i in range(20)
    ))  # fmt: skip
    assert read(path, channels="gyro").names == ("w_RS_S_x",)
    assert kinds(read(path, channels=["acc"], unit={"gyro": "deg/s", "acc": "g"})) == "a"
    with pytest.raises(InputError, match=r"no channel 'gw'.*gx, gy"):
        read(six, channels=["gw"])


def test_a_given_rate_sets_the_stamps_aside_and_says_so(six: Path, tmp_path: Path) -> None:
    recording = read(six, rate=50)
    assert recording.rate == 50
    assert recording.history[-1]["stamps_set_aside"] == "t"
    assert recording.notes["timebase"]["source"] == "rate argument"
    stuck = tmp_path / "stuck.csv"
    stuck.write_text("t,wx\n" + "5.0,1.5\n" * 20)
    assert read(stuck, rate=10).n_samples == 20
    for rate in (0, -1, float("nan"), float("inf"), "100", True):
        with pytest.raises(InputError, match="rate"):
            read(six, rate=rate)  # type: ignore[arg-type]


def test_numbered_samples_place_gaps(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("seq,wx\n" + "".join(f"{k},{k}.5\n" for k in range(100) if not 40 <= k < 45))
    recording = read(path, rate=10)
    assert recording.n_samples == 100
    assert recording.notes["timebase"]["gap_places"] == [[40, 45]]
    assert np.isnan(recording.values("wx")[40:45]).all()


def test_json_is_no_log_and_a_result_says_what_shows_it(tmp_path: Path) -> None:
    path = tmp_path / "study.json"
    for content, words in {
        '{\n "format": "allanite-study",\n "x": [1, 2]}': "result of allanite .study., not a log; `allanite report",
        '{"a": [1, 2]}': "is JSON",
        "[[1, 2], [3, 4]]": "is JSON",
    }.items():
        path.write_text(content)
        with pytest.raises(FormatError, match=words):
            read(path, rate=1)
    path.write_text("{t},wx\n" + "".join(f"{k},1.{k}\n" for k in range(20)))
    assert read(path, rate=1).n_samples == 20


def test_options_without_meaning_are_refused(six: Path, tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", GYRO)
    with pytest.raises(InputError, match=r"topic.*text file"):
        read(six, topic="/imu")
    with pytest.raises(InputError, match=r"delimiter.*NumPy"):
        read(tmp_path / "a.npy", delimiter=",")
    with pytest.raises(InputError, match="single array"):
        read(tmp_path / "a.npy", variable="x", rate=1)
    with pytest.raises(InputError, match="one table"):
        read(six, variable="IMU")
    with pytest.raises(InputError, match="delimiter must be"):
        read(six, delimiter="x")
    with pytest.raises(InputError, match="decimal must be"):
        read(six, decimal=";")
    with pytest.raises(InputError, match="sampling"):
        read(six, sampling="median")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="layout must be a YAML file or a mapping"):
        read(tmp_path / "a.npy", layout=3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="no such file"):
        read(tmp_path / "absent.csv")
    with pytest.raises(FormatError, match="folder"):
        read(tmp_path)
    with pytest.raises(TypeError):
        read(six, colour="red")  # type: ignore[call-arg]


def test_delimiter_and_decimal_settle_what_cannot_be_told(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("".join(f"1,{k % 4}5\n" for k in range(20)))
    one = read(path, rate=1)
    assert one.names == ("ch0",)
    assert one.values("ch0")[1] == 1.15
    two = read(path, rate=1, delimiter=",")
    assert two.values("ch1")[1] == 15
    assert read(path, rate=1, decimal=".").names == ("ch0", "ch1")
    path.write_text("".join(f"{k}\t{k % 4},5\n" for k in range(20)))
    assert read(path, rate=1, delimiter="tab").values("ch0")[1] == 1.5


def test_sampling_convention_goes_into_the_channels(six: Path) -> None:
    assert {c.sampling for c in read(six, sampling="point").channels} == {"point"}


def test_notes_hold_what_was_understood(six: Path) -> None:
    notes = read(six).notes
    assert set(notes["text"]) == {
        "delimiter", "decimal", "encoding", "header_rows", "preamble_lines", "ragged", "ragged_rows",
        "missing_cells", "overload_words", "unterminated_last_line", "bom", "nul_bytes", "units_from", "guesses",
    }  # fmt: skip
    assert set(notes["timebase"]) == {
        "source", "unit", "rate", "rate_nominal", "median_rate", "jitter_rms_s", "duplicates", "duplicate_rows",
        "backward", "backward_rows", "gaps", "missing", "gap_places", "drift_ppm", "resolution_s", "span_s",
        "rate_change_ppm", "rate_change_error_ppm", "unplaced", "wander_s", "set_back", "alone", "off_grid",
    }  # fmt: skip
    assert notes["source"]["format"] == "text"
    assert notes["source"]["size_bytes"] == six.stat().st_size


def test_time_alone_is_no_recording(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t\n" + "".join(f"{k / 10}\n" for k in range(20)))
    with pytest.raises(InputError, match="no other numbers"):
        read(tmp_path / "a.csv")
    (tmp_path / "a.csv").write_text("t,wx\n" + "".join(f"{k / 10},0x{k:02x}\n" for k in range(20)))
    with pytest.raises(InputError, match=r"no other numbers \(text columns left out: wx\)"):
        read(tmp_path / "a.csv")


def test_reading_loads_nothing_heavy_before_it_is_needed() -> None:
    code = "import sys; from allanite.files.readers import read; "
    code += "print({'scipy', 'pyarrow', 'rosbags'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_a_header_in_another_encoding_may_be_repeated(tmp_path: Path) -> None:
    rows = "".join(f"{k / 10:.1f};{k},5\n".replace(".", ",") for k in range(10))
    (tmp_path / "a.csv").write_text(("Zeit [s];Drehrate [°/s]\n" + rows) * 2, encoding="cp1252")
    recording = read(tmp_path / "a.csv")
    assert (recording.n_samples, recording.notes["text"]["encoding"]) == (20, "cp1252")
    assert recording.notes["timebase"]["backward_rows"] == [10]
    assert recording["Drehrate"].unit == "°/s"


@pytest.mark.parametrize(
    "between", [",", ";", "\t", "|", " "], ids=["comma", "semicolon", "tab", "bar", "blank"]
)
@pytest.mark.parametrize(
    "header",
    [
        "time [s],gx [deg/s],gy [deg/s]",
        "# time gx gy",
        "time;gx;gy",
        "% Columns: t, gx, gy",
        "time\tgx\tgy",
        "// t | gx | gy",
    ],
)
def test_a_header_may_have_another_delimiter_than_the_data(tmp_path: Path, header: str, between: str) -> None:
    rows = [between.join([f"{k / 100:.2f}", f"{k % 7}.25", f"{k % 5}.5"]) for k in range(50)]
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]))
    recording = read(tmp_path / "a.csv")
    assert (recording.names, recording.rate) == (("gx", "gy"), 100.0)
    assert recording["gx"].unit == ("deg/s" if "deg/s" in header else "")


@pytest.mark.parametrize(
    "line",
    [
        "# gyro bias test",
        "# gyro temperature log",
        "Sensor A, gyro rate, at rest",
        "# gyro, 100 Hz, 25 C",
        "Channels: 3",
    ],
)
def test_a_sentence_above_the_data_is_no_header(tmp_path: Path, line: str) -> None:
    for between in (";", "\t"):
        rows = [between.join([f"{k / 100:.2f}", f"{k % 7}.25", f"{k % 5}.5"]) for k in range(50)]
        (tmp_path / "a.csv").write_text("\n".join([line, *rows]))
        assert read(tmp_path / "a.csv").names == ("ch0", "ch1")


def test_a_time_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,wx\n" + "".join(f"T+{k}s,{k}.5\n" for k in range(10)))
    with pytest.raises(InputError, match=r"--rate.*text columns left out: time"):
        read(tmp_path / "a.csv")


# -- Parquet of our own ------------------------------------------------------------------------------------


def test_a_recording_written_as_parquet_comes_back_whole(tmp_path: Path) -> None:
    source = tmp_path / "a.csv"
    source.write_text(
        "t,wx,counts (LSB)\n" + "".join(f"{k / 8},{k}.25,{2**60 + k}\n" for k in range(100) if k != 7)
    )
    recording = read(source, unit={"wx": "deg/h"}).window(1.0, 10.0)
    parquet.write(recording, tmp_path / "a.parquet")
    back = read(tmp_path / "a.parquet")
    assert back.channels == recording.channels
    assert (back.rate, back.start, back.n_samples) == (recording.rate, recording.start, recording.n_samples)
    for name in recording.names:
        ours, theirs = recording.values(name), back.values(name)
        assert np.array_equal(ours + recording.origin(name), theirs + back.origin(name), equal_nan=True)
    assert back.history[: len(recording.history)] == recording.history
    assert back.columns[1].dtype == np.int64


@pytest.mark.parametrize(
    ("step", "dtype", "dictionary"),
    [(0.0, np.float64, False), (0.0, np.float32, False), (1e-2, np.float64, True), (1.0, np.int32, True)],
)
def test_a_dictionary_is_made_of_few_levels_only(
    step: float, dtype: type, dictionary: bool, tmp_path: Path
) -> None:
    """One of samples without repeats takes four times as long as their writing, and larger files."""
    import pyarrow.parquet as pq

    y = np.random.default_rng(4).standard_normal(30_000)
    samples = (np.round(y / step) * step if step else y).astype(dtype)
    samples = np.where(np.arange(len(y)) % 100 == 7, np.nan, samples) if dtype is np.float64 else samples
    parquet.write(Recording.from_rate(samples, rate=10.0, unit="rad/s"), tmp_path / "a.parquet")
    encodings = pq.ParquetFile(tmp_path / "a.parquet").metadata.row_group(0).column(0).encodings
    assert ("RLE_DICTIONARY" in encodings) is dictionary
    back = read(tmp_path / "a.parquet")
    np.testing.assert_array_equal(back.values(back.names[0]), samples.astype(np.float64))


def test_lazy_columns_read_any_stretch(tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    values = np.arange(1000.0)
    pq.write_table(pa.table({"gyro_x": values, "gyro_y": -values}), tmp_path / "a.parquet", row_group_size=37)
    column = read(tmp_path / "a.parquet", rate=1).columns[1]
    for start, stop in itertools.product((0, 36, 37, 500), (37, 38, 501, 1000, 2000)):
        assert np.array_equal(column.read(start, stop), -values[start:stop])
    assert len(column) == 1000


# -- headings, preambles, dates ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "name", "unit", "group"),
    [
        ("Gyroscope X (deg/s)", "Gyroscope_X", "deg/s", "gyro"),
        ("Drehrate [°/h]", "Drehrate", "°/h", "gyro"),
        ("acc_x_g", "acc_x", "g", "acc"),
        ("acc (G)", "acc", "g", "acc"),
        ("gyro_rad[0]", "gyro_rad_0", "rad/s", "gyro"),
        ("accelerometer_m_s2[2]", "accelerometer_m_s2_2", "m/s²", "acc"),
        ("field.angular_velocity.x", "field.angular_velocity.x", "rad/s", "gyro"),
        ("UncalGyroXRadPerSec", "UncalGyroX", "rad/s", "gyro"),
        ("AccelZMps2", "AccelZ", "m/s²", "acc"),
        ("utcTimeMillis", "utcTimeMillis", "ms", "time"),
        ("tod_s", "tod", "s", "time"),
        ("AngularVelocity_X", "AngularVelocity_X", "rad/s", "gyro"),
        ("angularVelocity.x", "angularVelocity.x", "", "gyro"),  # of any program, in any unit: asked
        ("linearAcceleration_y", "linearAcceleration_y", "", "acc"),
        ("angular_velocity_covariance_0", "angular_velocity_covariance_0", "", "other"),
        ("TimeUS", "TimeUS", "µs", "time"),
        ("Timestamp [ms]", "Timestamp", "ms", "time"),
        ("Temperature (degC)", "Temperature", "degC", "temperature"),
        ("GyroTemp", "GyroTemp", "", "temperature"),
        ("Magnetometer X (uT)", "Magnetometer_X", "uT", "other"),
        ("INDEX", "INDEX", "", "counter"),
        ("out (V)", "out", "V", ""),
        ("gyro (raw)", "gyro", "", "gyro"),
        ("", "", "", ""),
    ],
)
def test_headings(text: str, name: str, unit: str, group: str) -> None:
    heading = read_heading(text)
    assert (heading.name, heading.unit, heading.group) == (name, unit, group)


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("# fs=200 Hz", 200),
        ("Fs,100", 100),
        ("Rate: 100 Hz", 100),
        ("Sampling rate (kHz): 2", 2000),
        ("Abtastrate = 31,25 Hz", 31.25),
        ("data interval 1.0 s", 1),
        ("Sample interval: 10 ms", 100),
        ("dt = 0.004", 250),
        ("ODR;416", 416),
        ("output data rate is 104 Hz", 104),
        ("baud rate: 115200", None),
        ("frequency of 10 MHz OCXO", None),
        ("sampling-interval(ms), g(m/s^2)", None),
        ("range: 250 deg/s", None),
        ("rate: 250 deg/s", None),
        ("fs = 0 Hz", None),
    ],
)
def test_rates_in_preambles(line: str, rate: float | None) -> None:
    assert rate_in([line]).rate == (None if rate is None else pytest.approx(rate))


def test_serial_number_and_sensor_in_preambles() -> None:
    assert facts_in(["Device: SiRRS01-03", "S/N: A-17"]) == {"serial": "A-17", "sensor": "SiRRS01-03"}
    assert rate_in(["fs=100", "rate: 200"]).guesses != ()


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("2026-09-01T12:30:00.25Z", "iso8601"),
        ("2026-09-01 14:30:00.25+02:00", "iso8601"),
        ("01-Sep-2026 (12:30:00.250000)", "dd-mon-yyyy"),
        ("Sep 1, 2026 12:30:00.25 PM", "dd-mon-yyyy"),
        ("Tue Sep  1 12:30:00.25 2026", "dd-mon-yyyy"),
        ("1 September 2026, 12:30:00.25", "dd-mon-yyyy"),
        ("20260901T123000.25Z", "yyyymmdd"),
        ("20260901_12:30:00.25", "yyyymmdd"),
    ],
)
def test_dates(text: str, name: str) -> None:
    moment = int(np.datetime64("2026-09-01T12:30:00.25", "ns").astype(np.int64))
    assert date_format(text) == name
    assert to_nanoseconds([text], name)[0] == moment
    assert date_format(text + "x") is None


# -- real recordings -----------------------------------------------------------------------------------------


def test_real_openaxes_rate_is_that_of_the_stamps_as_a_whole(real_data: Callable[[str], Path]) -> None:
    recording = read(
        real_data("openaxes_d20/log_imu9_2022-06-22_22-13-55.csv"), unit={"gyro": "rad/s", "acc": "m/s^2"}
    )
    assert recording.rate == pytest.approx(100.06, abs=0.01)
    assert recording.notes["timebase"]["median_rate"] == pytest.approx(89.2, abs=0.1)
    assert (recording.n_samples, recording.notes["timebase"]["gaps"]) == (23_725, 0)
    assert {c.kind for c in recording.channels} == {Kind.RATE, Kind.ACCELERATION, Kind.OTHER}


def test_real_xio_units_in_the_header_and_ten_gaps(real_data: Callable[[str], Path]) -> None:
    recording = read(real_data("formats_misc/xio_fusion_sensor_data.csv"))
    facts = recording.notes["timebase"]
    assert recording.n_samples - facts["missing"] == 13_514
    # 13 514 rows in 135.3 s are 99.85 per second; ten stamps jump by 30 ms, two samples each: 100 Hz.
    assert recording.n_samples / recording.duration == pytest.approx(100.0, abs=0.01)
    assert (facts["gaps"], facts["missing"]) == (10, 20)
    assert kinds(recording) == "wwwaaa..."


def test_real_psins_counts_behind_three_rows_of_parameters(real_data: Callable[[str], Path]) -> None:
    recording = read(real_data("psins_lasergyro/lasergyro.imu"), rate=100)
    assert recording.n_samples == 184_718
    derived = read(real_data("psins_lasergyro/lasergyro.npz"))
    assert derived.rate == 100.0
    assert np.allclose(recording.values("ch0") * 10, derived.values("gyro_x"))
    assert kinds(derived) == "wwwaaa"


def test_real_ros_containers_give_equal_numbers(real_data: Callable[[str], Path]) -> None:
    pytest.importorskip("rosbags", reason="the extra allanite[ros] is not installed")
    folder = real_data("formats_ros")
    names = ("phidgets_imu_upside_down.bag", "phidgets_ros2_sqlite3", "phidgets_ros2_mcap")
    bag, *others = (read(folder / n) for n in names)
    facts = bag.notes["timebase"]
    assert bag.n_samples - facts["missing"] == 13_964
    assert bag.duration == pytest.approx(56.24, abs=0.01)
    assert bag.rate == pytest.approx(250.0, rel=2e-4)
    for other in others:
        assert same(bag, other)
        assert other.start == bag.start


@pytest.mark.parametrize(
    "name",
    [
        "psins_sysclbt_simulated/imusysclbt.bin",
        "README.md",
    ],
)
def test_real_files_of_other_kinds_say_what_to_do(real_data: Callable[[str], Path], name: str) -> None:
    with pytest.raises(FormatError, match=r"layout=|number"):
        read(real_data(name))


def test_real_mat_with_two_tables(real_data: Callable[[str], Path]) -> None:
    path = real_data("psins_sysclbt_simulated/transfer_align_fog_mems.mat")
    recording = read(path)
    assert (recording.rate, recording.n_samples, len(recording.names)) == (100.0, 10_001, 6)
    assert any("fogavp" in g for g in recording.notes["source"]["guesses"])


def test_all_stamps_equal_is_refused_with_rows(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,wx\n" + "5.0,1.5\n" * 20)
    with pytest.raises(DataQualityError, match=r"row 0.*row 4.*--rate"):
        read(tmp_path / "a.csv")


@pytest.mark.long
def test_channels_of_one_parquet_file_are_read_by_several_threads(tmp_path: Path) -> None:
    """One reader of the file serves them all; two reads at once used to block for ever."""
    from concurrent.futures import ThreadPoolExecutor

    y = np.random.default_rng(3).standard_normal((400_000, 6))
    record = Recording.from_rate(y, rate=100.0, unit="deg/s")
    parquet.write(record, tmp_path / "six.parquet")
    again = read(tmp_path / "six.parquet")
    with ThreadPoolExecutor(4) as pool:
        jobs = [pool.submit(again.values, name) for name in again.names * 3]
        for job, column in zip(jobs, [*range(6)] * 3, strict=True):
            np.testing.assert_array_equal(job.result(timeout=60), y[:, column])


@pytest.mark.parametrize("row", [0, 7, 199])
@pytest.mark.parametrize(
    "word",
    [
        "9.9E+37",
        "-9.9E37",
        "+9.90000000E+37",
        "9.91E37",
        "1E38",
        "1.0e+38",
        "+OFLOW",
        "O.L",
        "-overload",
        "OVLD",
    ],
)
def test_an_overload_is_missing_as_the_meter_answers_it(tmp_path: Path, word: str, row: int) -> None:
    """With a decimal point, between numbers with decimal commas."""
    values = np.round(np.random.default_rng(3).standard_normal(200), 4)
    cells = [f"{v:.4f}".replace(".", ",") for v in values]
    cells[row] = word
    path = tmp_path / "meter.csv"
    path.write_text("t [s];U [mV]\n" + "".join(f"{i};{cell}\n" for i, cell in enumerate(cells)))
    recording = read(path)
    assert np.flatnonzero(np.isnan(recording.values("U"))).tolist() == [row]
    assert np.array_equal(np.delete(recording.values("U"), row), np.delete(values, row))
    assert [f.count for f in check(recording) if f.code == "overload"] == [1]


@pytest.mark.parametrize("cell", ["9.8", "1.5E37", "9.9E3", "9.9E137", "1E3.8"])
def test_other_numbers_with_another_decimal_sign_are_refused(tmp_path: Path, cell: str) -> None:
    path = tmp_path / "meter.csv"
    path.write_text("t [s];U [mV]\n" + "".join(f"{i};0,{i:03d}\n" for i in range(200)) + f"200;{cell}\n")
    with pytest.raises(FormatError, match="is not a number"):
        read(path)
