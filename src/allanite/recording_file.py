# SPDX-License-Identifier: BSD-3-Clause
"""A Recording to a file that `allanite.readers.read` takes back: Parquet, NumPy or CSV, by the suffix.

Parquet keeps everything (rate, start, units, sampling, history; missing samples are nulls). CSV keeps the rate, to
nine digits of its time stamps, and the units. A NumPy array keeps the samples alone. Neither has a place for a
scale factor, so samples that were read through one (volts of a gyro) are written there in SI units.

Files are written block by block, so a recording may be larger than memory.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from allanite.atomic_file import fresh, refuse_existing
from allanite.columns import Samples
from allanite.errors import InputError
from allanite.recording import BLOCK, OVERLOAD, Channel, Kind, Recording

__all__ = ["FORMATS", "refuse_recording", "summary", "write_recording"]

Progress = Callable[[float], None]

_SI = {
    Kind.RATE: "rad/s",
    Kind.ANGLE: "rad",
    Kind.ACCELERATION: "m/s^2",
    Kind.VELOCITY: "m/s",
    Kind.VOLTAGE: "V",
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
    path : path
        ``.parquet``, ``.npy`` or ``.csv``.
    force : bool
        Replace a file that is there.
    progress : callable, optional
        Called with the fraction written.

    Raises
    ------
    InputError
        Another suffix.
    StorageError
        The file exists and `force` is not given, or the disk refuses.
    """
    target = Path(path)
    write = FORMATS.get(target.suffix.lower())
    if write is None:
        raise InputError(
            f"{target.name}: a recording is written as {', '.join(FORMATS)}; give one of these suffixes"
        )
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


def summary(recording: Recording, path: Path) -> str:
    """What was written, and which options `allanite.read` needs to read it."""
    said = f"{path}: {recording.n_samples} samples of {', '.join(recording.names)} at {recording.rate:.9g} Hz"
    options = [] if path.suffix.lower() != ".npy" else [f"--rate {recording.rate:.9g}"]
    if path.suffix.lower() != ".parquet":
        scaled = [(c.name, _written(c)[0]) for c in recording.channels if _written(c)[0] != c.unit]
        said += "".join(f", {name} through its scale factor in {unit}" for name, unit in scaled)
    units = {_written(c)[0] for c in recording.channels}
    if options and len(units) == 1:
        options.append(f"--unit {units.pop()}")
    if path.suffix.lower() != ".parquet" and recording.channels[0].sampling == "point":
        options.append("--sampling point")
    return f"{said} (read it with {' '.join(options)})" if options else said


def _written(channel: Channel) -> tuple[str, float]:
    """Unit in which a table without room for scale factors holds a channel, and the factor of its samples."""
    if channel.kind not in _SI or not channel.unit or Channel.of("", channel.unit).kind is channel.kind:
        return channel.unit, 1.0
    return _SI[channel.kind], channel.scale


def _parquet(recording: Recording, place: Path, progress: Progress) -> None:
    from allanite.readers import parquet

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
            table[start : start + block.size, i] = (block + recording.origin(channel.name)) * factor
            progress((i + (start + block.size) / shape[0]) / shape[1])
    target.flush()


def _csv(recording: Recording, place: Path, progress: Progress) -> None:
    units, factors = zip(*map(_written, recording.channels), strict=True)
    heads = [f"{n} [{unit}]" if unit else n for n, unit in zip(recording.names, units, strict=True)]
    rows = BLOCK // 8
    with place.open("w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(_cell(head) for head in ["time [s]", *heads]) + "\n")
        for start in range(0, recording.n_samples, rows):
            stop = min(start + rows, recording.n_samples)
            columns = [np.arange(start, stop) / recording.rate]
            columns += [
                _scaled(recording.raw(name, start, stop) + recording.origin(name), factor)
                for name, factor in zip(recording.names, factors, strict=True)
            ]
            times, *values = (column.tolist() for column in columns)
            lines = (
                f"{t:.9f}," + ",".join("" if v != v else repr(v) for v in row)
                for t, row in zip(times, zip(*values, strict=True), strict=True)
            )
            file.write("\n".join(lines) + "\n")
            progress(stop / recording.n_samples)


def _scaled(samples: Samples, factor: float) -> Samples:
    """Samples in another unit; overload words stay what they are."""
    return samples if factor == 1.0 else np.where(np.abs(samples) >= OVERLOAD, samples, samples * factor)


def _cell(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\n\r') else text


FORMATS: Mapping[str, Callable[[Recording, Path, Progress], None]] = {
    ".parquet": _parquet,
    ".npy": _npy,
    ".csv": _csv,
}
"""Suffix -> writer."""
