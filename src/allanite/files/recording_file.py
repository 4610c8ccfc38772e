# SPDX-License-Identifier: BSD-3-Clause
"""A Recording to a file that `allanite.files.readers.read` takes back: Parquet, NumPy, CSV or MATLAB, by the suffix.

Parquet keeps everything (rate, start, units, sampling, history; missing samples are nulls). A NumPy archive (.npz) and
a MATLAB file keep rate, names and units; CSV the units, and the rate to nine digits of its time stamps. A NumPy array
(.npy) keeps the samples alone. None of these has a place for a scale factor, so samples that were read through one
(volts of a gyro) are written there in SI units.

Files are written block by block, so a recording may be larger than memory.
"""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.plain_files.atomic_file import fresh, refuse_existing
from allanite.plain_files.csv_cells import heading_cell
from allanite.recording.records import BLOCK, OVERLOAD, Channel, Kind, Recording
from allanite.recording.sample_columns import Samples

__all__ = ["FORMATS", "refuse_recording", "summary", "write_recording"]

Progress = Callable[[float], None]

_MEMBERS = ("fs", "units")  # of an archive, beside the channels
_MOST_MATLAB = 2**31  # bytes of one variable

_SI = {
    Kind.RATE: "rad/s",
    Kind.ANGLE: "rad",
    Kind.ACCELERATION: "m/s^2",
    Kind.VELOCITY: "m/s",
    Kind.VOLTAGE: "V",
    Kind.PHASE: "s",
    Kind.FREQUENCY: "1",
    Kind.TEMPERATURE: "K",
}


def write_recording(
    recording: Recording,
    path: str | os.PathLike[str],
    *,
    force: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Write a recording; the suffix of the path says the format.

    Parameters
    ----------
    recording : Recording
        Recording to write.
    path : path
        ``.parquet``, ``.npy``, ``.csv``, ``.npz`` or ``.mat``.
    force : bool
        Replace a file that is there.
    progress : callable, optional
        Called with the fraction written.

    Raises
    ------
    InputError
        Another suffix, a channel whose name the file would not give back, or more samples than a MATLAB file of
        version 5 takes.
    StorageError
        The file exists and `force` is not given, or the disk refuses.
    """
    target = Path(path)
    write = FORMATS.get(target.suffix.lower())
    if write is None:
        raise InputError(
            f"{target.name}: a recording is written as {', '.join(FORMATS)}; give one of these suffixes"
        )
    _refuse_names(recording, target)
    with fresh(target, force=force) as place:
        write(recording, place, progress or (lambda _: None))
    return target


def refuse_recording(path: str | os.PathLike[str], *, force: bool) -> None:
    """Raise, before hours are spent, if no recording can be written there; see `write_recording`."""
    if Path(path).suffix.lower() not in FORMATS:
        raise InputError(
            f"{path}: a recording is written as {', '.join(FORMATS)}; give one of these suffixes"
        )
    refuse_existing(path, force=force)


def _refuse_names(recording: Recording, target: Path) -> None:
    """Raise if a name would be lost, or would hide the rate or the units; an array alone holds no names."""
    suffix = target.suffix.lower()
    for name in recording.names if suffix != ".npy" else ():
        if not name.isprintable():
            why = "contains nonprinting characters (a line end, a NUL), which cannot be read back"
        elif suffix == ".npz" and name in _MEMBERS:
            why = "is reserved for other content of the archive"
        else:
            continue
        raise InputError(f"{target.name}: the name of channel {name!r} {why}; give the channel another name")


def summary(recording: Recording, path: Path) -> str:
    """What was written, and which options `allanite.read` needs to read it."""
    line = f"{path}: {recording.n_samples} samples of {', '.join(recording.names)} at {recording.rate:.9g} Hz"
    options = [] if path.suffix.lower() != ".npy" else [f"--rate {recording.rate:.9g}"]
    if path.suffix.lower() != ".parquet":
        scaled = [(c.name, _written(c)[0]) for c in recording.channels if _written(c)[0] != c.unit]
        line += "".join(f", {name} through its scale factor in {unit}" for name, unit in scaled)
    units = {_written(c)[0] for c in recording.channels}
    if options and len(units) == 1:
        options.append(f"--unit {units.pop()}")
    if path.suffix.lower() != ".parquet" and recording.channels[0].sampling == "point":
        options.append("--sampling point")
    return f"{line} (read it with {' '.join(options)})" if options else line


def _written(channel: Channel) -> tuple[str, float]:
    """Unit in which a table without room for scale factors holds a channel, and the factor of its samples."""
    if channel.kind not in _SI or not channel.unit or Channel.of("", channel.unit).kind is channel.kind:
        return channel.unit, 1.0
    return _SI[channel.kind], channel.scale


def _parquet(recording: Recording, place: Path, progress: Progress) -> None:
    from allanite.files.readers import parquet

    parquet.write(recording, place)
    progress(1.0)


def _npy(recording: Recording, place: Path, progress: Progress) -> None:
    shape = (recording.n_samples, len(recording.channels))
    target = np.lib.format.open_memmap(
        place,
        mode="w+",
        dtype=np.float64,
        shape=shape if shape[1] > 1 else shape[:1],
        fortran_order=shape[1] > 1,
    )
    table = target.reshape(shape, order="F")
    for i, channel in enumerate(recording.channels):
        factor = _written(channel)[1]
        for start, block in recording.blocks(channel.name):
            table[start : start + block.size, i] = _scaled(block, recording.origin(channel.name), factor)
            progress((i + (start + block.size) / shape[0]) / shape[1])
    target.flush()


def _csv(recording: Recording, place: Path, progress: Progress) -> None:
    units, factors = zip(*map(_written, recording.channels), strict=True)
    heads = [f"{n} [{unit}]" if unit else n for n, unit in zip(recording.names, units, strict=True)]
    rows = BLOCK // 8
    with place.open("w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(heading_cell(head) for head in ["time [s]", *heads]) + "\n")
        for start in range(0, recording.n_samples, rows):
            stop = min(start + rows, recording.n_samples)
            columns = [np.arange(start, stop) / recording.rate]
            columns += [
                _scaled(recording.raw(name, start, stop), recording.origin(name), factor)
                for name, factor in zip(recording.names, factors, strict=True)
            ]
            times, *values = (column.tolist() for column in columns)
            lines = (
                f"{t:.9f}," + ",".join("" if v != v else repr(v) for v in row)
                for t, row in zip(times, zip(*values, strict=True), strict=True)
            )
            file.write("\n".join(lines) + "\n")
            progress(stop / recording.n_samples)


def _scaled(samples: Samples, origin: float, factor: float) -> Samples:
    """Samples in full and in another unit; overload words stay what they are, and a zero keeps its sign."""
    samples = samples + origin if origin else samples
    return samples if factor == 1.0 else np.where(np.abs(samples) >= OVERLOAD, samples, samples * factor)


def _npz(recording: Recording, place: Path, progress: Progress) -> None:
    """One member per channel, in the type in which it was written, beside ``fs`` and ``units``."""
    units = [_written(channel)[0] for channel in recording.channels]
    with zipfile.ZipFile(place, "w", allowZip64=True) as archive:
        for name, small in zip(
            _MEMBERS, (np.float64(recording.rate), np.array(units, dtype=np.str_)), strict=True
        ):
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.asanyarray(small), allow_pickle=False)
        done, whole = 0, recording.n_samples * len(recording.channels)
        for name, column, channel in zip(recording.names, recording.columns, recording.channels, strict=True):
            factor, plain = _written(channel)[1], column.dtype.kind in "iu" and not _has_gaps(recording, name)
            dtype = column.dtype.newbyteorder("=") if plain and factor == 1.0 else np.dtype(np.float64)
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                descr = np.lib.format.dtype_to_descr(dtype)
                header = {"descr": descr, "fortran_order": False, "shape": (recording.n_samples,)}
                np.lib.format.write_array_header_1_0(member, header)
                for _, block in recording.blocks(name):
                    member.write(_stored(block, recording.origin(name), factor, dtype).tobytes())
                    done += block.size
                    progress(done / whole)


def _has_gaps(recording: Recording, name: str) -> bool:
    return any(bool(np.isnan(block).any()) for _, block in recording.blocks(name))


def _stored(block: Samples, origin: float, factor: float, dtype: np.dtype[Any]) -> NDArray[Any]:
    if dtype.kind in "iu":  # exact: float64 has 53 bits, the samples may have 64
        wide = np.dtype(np.uint64 if dtype.kind == "u" else np.int64)
        return (block.astype(wide) + wide.type(int(origin))).astype(dtype)
    return _scaled(block, origin, factor)


def _mat(recording: Recording, place: Path, progress: Progress) -> None:
    """Version 5: the matrix ``samples``, the rate ``fs``, and the words ``columns`` and ``units``."""
    from scipy.io import savemat

    shape = (recording.n_samples, len(recording.channels))
    if 8 * shape[0] * shape[1] >= _MOST_MATLAB:
        raise InputError(
            f"{shape[0]} samples of {shape[1]} channels are more than a MATLAB file of version 5 takes (2 GiB); write "
            ".npz or .parquet, or fewer channels (--channels)"
        )
    table = np.empty(shape, order="F")
    for i, channel in enumerate(recording.channels):
        for start, block in recording.blocks(channel.name):
            values = _scaled(block, recording.origin(channel.name), _written(channel)[1])
            table[start : start + block.size, i] = values
        progress((i + 1) / (shape[1] + 1))
    words = {"columns": list(recording.names), "units": [_written(c)[0] for c in recording.channels]}
    cells = {key: np.array(several, dtype=object) for key, several in words.items()}
    savemat(place, {"fs": recording.rate, **cells, "samples": table}, appendmat=False)
    progress(1.0)


FORMATS: Mapping[str, Callable[[Recording, Path, Progress], None]] = {
    ".parquet": _parquet,
    ".npy": _npy,
    ".csv": _csv,
    ".npz": _npz,
    ".mat": _mat,
}
"""Suffix -> writer."""
