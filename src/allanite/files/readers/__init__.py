# SPDX-License-Identifier: BSD-3-Clause
"""Files in, a Recording out: `read` finds out by the content which reader a file belongs to.

One module per format: `numpy_file` (the example to imitate), `run`, `parquet`, `matlab`, `hdf5`, `rosbag`, `ardupilot`,
`ulog`, `mavlink`, `tdms`, `r_data`, `raw_binary`, `spreadsheet`, `text`. They share `assembly` (columns to a
Recording), `arrays` (named arrays to columns), `contents` (which of several tables is read), `curve_shape` (a table
that is no log), `clock_table` (phase and frequency), `headings` (what a column name says), `stamps` (which column is
time), `stated_time`, `stamp_units` and `turning` (how its values count), `stated_rate` (which rate of several
statements counts), `part` (between two times), `timebase` (stamps to an even grid, along the line of `clock_line`),
`spool` (unpacking within limits), `sandbox` (parsing in a child process), `hdf5_tree` (HDF5 that stays in its file),
`packed_values` (integers with a scale and an offset) and `record_chain` (records in a torn stream); `joining` makes
one log of several files.

To add a format: one module, one word in `READERS`, one folder in ``tests/samples``.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol, cast

from allanite.errors import FormatError, InputError
from allanite.plain_files.regular_file import open_regular
from allanite.recording.channel_names import for_shell
from allanite.recording.records import Recording, Sampling

if TYPE_CHECKING:
    from allanite.files.readers.table import Options, Table

__all__ = ["READERS", "read", "read_table"]

#: Modules of this package that read a format, in the order in which they are asked.
READERS: Final = (
    "numpy_file",
    "run",
    "parquet",
    "matlab",
    "hdf5",
    "rosbag",
    "ardupilot",
    "ulog",
    "mavlink",
    "tdms",
    "r_data",
    "raw_binary",
    "spreadsheet",
    "text",
)

_HEAD = 4096

# Beginnings of files that are recognised only to say what to do with them.
_OTHERS: Final = (
    (b"\x80\x02", "a Python pickle, which can run code and is never opened; save the samples with np.save"),
    (b"\x80\x03", "a Python pickle, which can run code and is never opened; save the samples with np.save"),
    (b"\x80\x04", "a Python pickle, which can run code and is never opened; save the samples with np.save"),
    (b"\x80\x05", "a Python pickle, which can run code and is never opened; save the samples with np.save"),
    (
        b"# format: allanite-curve",
        "an Allan curve, not a log; fit it with `allanite fit`, or read it with AllanCurve.from_csv",
    ),
    (
        b"# format: allanite-over-floor",
        "a table of Allan deviations, not a log; commands take the two logs: `allanite fit gyro.csv --floor short.csv`",
    ),
    (b"PK\x03\x04", "a zip archive without NumPy arrays; unpack it and read the file inside"),
    (b"\x28\xb5\x2f\xfd", "compressed with zstd; unpack it and read the result"),
)


class Reader(Protocol):
    """What a reader module has; see `allanite.files.readers.numpy_file`."""

    NAME: str
    OPTIONS: frozenset[str]

    def sniff(self, head: bytes, path: Path) -> bool:
        """True if the file is of this format, judged by its content."""
        ...

    def read(self, path: Path, options: Options) -> Table:
        """The columns of the file and what it says about them."""
        ...


def read(
    path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    unit: str | Mapping[str, str] | None = None,
    rate: float | None = None,
    channels: Sequence[str] | None = None,
    sampling: Sampling = "mean",
    scale_factor: str | Mapping[str, str] | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    topic: str | None = None,
    variable: str | None = None,
    layout: str | os.PathLike[str] | Mapping[str, Any] | None = None,
    time: str | None = None,
    start: float | None = None,
    stop: float | None = None,
    kind: str | None = None,
    carrier: float | None = None,
) -> Recording:
    """Read a log of a sensor.

    Parameters
    ----------
    path : path, or sequence of paths
        Text of any dialect (also .gz, .xz, .bz2), spreadsheets (.xlsx, .xls, .ods), NumPy .npy and .npz, Parquet,
        Arrow and Feather, MATLAB .mat (version 5 to 7.3), HDF5, LabVIEW TDMS, R .rda and .rds,
        ArduPilot .BIN, PX4 .ulg, MAVLink .tlog, ROS 1 bags and ROS 2 folders, .db3 and .mcap files, and runs of
        `allanite record` by their folder. The content decides,
        not the suffix. Several files of one log are joined by their time stamps, in whatever order they are given.
    unit : str or mapping, optional
        Unit of the samples where the file does not hold it: "deg/s", or by channel name or group,
        {"gyro": "deg/s", "acc": "g"}. A unit that nobody gives stays unknown; it is never assumed.
    rate : float, optional [Hz]
        Samples per second where the file has no time. It sets time stamps aside if there are any.
    channels : sequence of str, optional
        Names or groups (gyro, acc) to keep; all if absent.
    sampling : "mean" or "point"
        Whether a sample is the mean over its interval or an instantaneous value; see `Channel`.
    scale_factor : str or mapping, optional
        For samples in volts or counts, e.g. "24.0 mV/(deg/s)", {"gyro": "131 LSB/(deg/s)"}. A standard uncertainty,
        "24.0(2) mV/(deg/s)" or "24.0 ± 0.2 mV/(deg/s)", enters the intervals of fitted models.
    delimiter, decimal : str, optional
        Dialect of a text, if it is ambiguous: "," ";" "tab" "blank" "|", and "." or ",".
    topic : str, optional
        For ROS logs with several IMU topics ("/driver.left.imu" for one inside of another message); for flight logs
        the message and instance, "GYR[0]", "sensor_gyro[1]".
    variable : str, optional
        For files with several tables: name of the array (.npz, .mat, HDF5; of three dimensions with the record that is
        meant, "data[0]" as NumPy counts, "data(:, :, 1)" as MATLAB does), the group or dataset (HDF5, TDMS), the object
        (R), the sheet (spreadsheets), the record type, kind of sentence or sensor identity (text), or the part of a run
        whose settings changed ("2").
    layout : path or mapping, optional
        Layout of raw binary files and texts of hexadecimal words: a YAML file that describes their records, or its
        content as plain data.
    time : str, optional
        The time column, and its unit where the file does not hold it: "t", "t:ms", "2" (columns count from 1; rows of a
        matrix that holds its samples in rows). "cnt:1/1000 s" is a counter and its step, "cnt:2us:2^16" one that begins
        anew after 2^16 counts (told from the column where it is not said); "Date:dmy" is the order of a date; "none"
        says that no column is time.
    start, stop : float, optional [s]
        The part between two times since the first sample, by the stamps as they are (where there are none, or `rate`
        sets them aside, by the samples): it is cut before a time grid is made.
    kind : "phase" or "frequency", optional
        Kind of the samples of clocks and counters: the time error x(t), in s, ns, ps or cycles of a carrier, or
        fractional frequency. A phase is then never read as time.
    carrier : float, optional [Hz]
        Frequency of the carrier, for a phase in cycles, rad or deg, and for a frequency in Hz.

    Returns
    -------
    Recording
        Recording; its `notes` and the first step of its `history` state how the file was read.

    Raises
    ------
    InputError
        Something is missing or does not fit: no rate, a wrong unit, several tables.
    FormatError
        The file breaks its format, or its format is not known.
    LimitError
        The file asks for more memory or time than it may.
    DataQualityError
        No samples, or time stamps from which no even grid can be built.

    Examples
    --------
    >>> recording = read("gyro.csv", unit="deg/s")  # doctest: +SKIP
    """
    from allanite.files.readers.assembly import assemble
    from allanite.files.readers.curve_shape import refuse_curve
    from allanite.files.readers.joining import join
    from allanite.files.readers.table import Options

    options = Options(
        unit=unit,
        rate=rate,
        channels=channels,
        sampling=sampling,
        scale_factor=scale_factor,
        delimiter=delimiter,
        decimal=decimal,
        topic=topic,
        variable=variable,
        layout=layout,
        time=time,
        start=start,
        stop=stop,
        kind=kind,
        carrier=carrier,
    )
    if carrier is not None and kind is None:
        raise InputError("--carrier (carrier=) goes with --kind phase or --kind frequency (kind=)")
    paths = _paths(path)
    tables = []
    for place in paths:
        reader = _reader_for(place) if layout is None else _raw(place)
        _refuse_meaningless(options, reader)
        tables.append(reader.read(place, options))
        refuse_curve(tables[-1], place)
    names = [p.name for p in paths]
    return assemble(
        join(tables, names, options), options, names[0] if len(names) == 1 else " + ".join(sorted(names))
    )


def read_table(
    path: str | os.PathLike[str],
    *,
    delimiter: str | None = None,
    decimal: str | None = None,
    variable: str | None = None,
) -> Table:
    """The columns of a file as they are, without time, channels or units made of them; options are those of `read`.

    Raises
    ------
    InputError, FormatError, LimitError
        As for `read`.
    """
    from allanite.files.readers.table import Options

    options = Options(delimiter=delimiter, decimal=decimal, variable=variable)
    (place,) = _paths(path)
    reader = _reader_for(place)
    _refuse_meaningless(options, reader)
    return reader.read(place, options)


def _paths(path: object) -> list[Path]:
    several = [path] if isinstance(path, (str, os.PathLike)) else path
    if hasattr(path, "read"):
        raise InputError(
            f"read needs the path of a file, not a {type(path).__name__}: save its bytes first, "
            "Path('log.csv').write_bytes(stream.read())"
        )
    if isinstance(path, Mapping) or hasattr(path, "__array__") or hasattr(path, "__arrow_c_stream__"):
        raise InputError(
            f"read needs the path of a file, not a {type(path).__name__}; for samples in memory use "
            "al.Recording.from_samples(samples, time='t', unit='deg/s')"
        )
    if not isinstance(several, Iterable) or isinstance(several, bytes):
        raise InputError(
            f"read needs the path of a file, al.read('gyro.csv'), or several of them, not {path!r}"
        )
    paths = []
    for one in several:
        if not isinstance(one, (str, os.PathLike)):
            raise InputError(
                f"read needs paths of files, not a {type(one).__name__}; for samples in memory use "
                "al.Recording.from_samples(samples, rate=100.0, unit='deg/s')"
            )
        paths.append(Path(one))
    if not paths:
        raise InputError("no file given")
    return paths


def _raw(path: Path) -> Reader:
    """The reader of files that a layout describes: their content is not asked."""
    if path.is_dir():
        raise InputError(f"{path} is a folder, but layout= describes a file")
    _head(path)
    return cast(Reader, import_module(f"{__name__}.raw_binary"))


def _reader_for(path: Path) -> Reader:
    head = _head(path)
    for name in READERS:
        if name == READERS[-1]:  # nearly everything is text to the last one
            _refuse_others(head, path)
        reader = cast(Reader, import_module(f"{__name__}.{name}"))
        if reader.sniff(head, path):
            return reader
    if path.is_dir():
        raise FormatError(
            f"{path} is a folder without a run (manifest.jsonl) or a ROS 2 recording (metadata.yaml, .db3, .mcap)"
        )
    raise FormatError(
        f"{path.name} is binary, in an unknown format. If you know its records, describe them in a small "
        "YAML file and read it with layout= (--layout)"
    )


def _refuse_others(head: bytes, path: Path) -> None:
    for magic, what in _OTHERS:
        if head.startswith(magic):
            raise FormatError(f"{path.name} is {what}")
    ours = re.match(rb'\s*\{\s*"format"\s*:\s*"allanite-([a-z-]+)"', head)
    if ours:
        raise FormatError(
            f"{path.name} is a result of allanite ({ours[1].decode()}), not a log; "
            f"`allanite report {for_shell(str(path))}` shows it, and commands that take a model or a calibration "
            "take it"
        )


def _head(path: Path) -> bytes:
    try:
        if path.is_dir():
            return b""
        with open_regular(path) as file:
            head = file.read(_HEAD)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"no such file: {path}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be opened: {error}") from None
    if not head:
        raise FormatError(f"{path.name} is empty")
    return head


def _refuse_meaningless(options: Options, reader: Reader) -> None:
    special: dict[str, Any] = {
        f.name: getattr(options, f.name)
        for f in fields(options)
        if f.name in ("delimiter", "decimal", "topic", "variable", "layout")
    }
    for name, value in special.items():
        if value is not None and name not in reader.OPTIONS:
            raise InputError(f"option {name}={value!r} does not apply to a {reader.NAME} file")
