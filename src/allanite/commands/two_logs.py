# SPDX-License-Identifier: BSD-3-Clause
"""A unit whose accelerometers and gyros were written into two files, sample by sample, made one recording."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.commands.recordings import read_part
from allanite.errors import InputError
from allanite.recording.calibration import ACCELEROMETER, GYRO

if TYPE_CHECKING:
    from allanite.recording.records import Recording

__all__ = ["joined", "read_two"]

#: What a triad is called before "=" in --unit and --scale-factor.
_GROUPS = {ACCELEROMETER: ("accelerometer", "acc"), GYRO: ("gyro",)}
#: Before a name that both files have.
_PREFIX = {ACCELEROMETER: "acc", GYRO: "gyro"}


def read_two(
    log: str | os.PathLike[str],
    gyro_log: str | os.PathLike[str],
    *,
    accelerometer: Sequence[str] | None = None,
    gyro: Sequence[str] | None = None,
    **options: Any,
) -> tuple[Recording, tuple[str, ...], tuple[str, ...]]:
    """The recording of both, and the channels of its accelerometers and its gyros.

    Parameters
    ----------
    log, gyro_log : path
        Of the accelerometers, and of the gyros.
    accelerometer, gyro : sequence of str, optional
        Channels x, y, z, each by its name in its own file; by default the only three.
    **options
        Those of `read`; units and scale factors by "acc" and "gyro" go to their own file.

    Raises
    ------
    InputError
        Files that do not hold the same instants, or a file without three channels of its triad.
    """
    first = read_part(log, **_own(options, ACCELEROMETER))
    second = read_part(gyro_log, **_own(options, GYRO))
    names = {
        ACCELEROMETER: _three(first, accelerometer, ACCELEROMETER), GYRO: _three(second, gyro, GYRO)
    }  # fmt: skip
    return joined(first, second, names[ACCELEROMETER], names[GYRO])


def joined(
    first: Recording, second: Recording, accelerometer: Sequence[str], gyro: Sequence[str]
) -> tuple[Recording, tuple[str, ...], tuple[str, ...]]:
    """The channels of both that are named, with the time of the first, and their names in it.

    Raises
    ------
    InputError
        They do not hold the same instants.
    """
    _refuse_other_instants(first, second)
    both = set(first.names) & set(second.names)
    places = [(ACCELEROMETER, first, n) for n in first.names] + [(GYRO, second, n) for n in gyro]

    def name(sensor: str, given: str) -> str:
        return f"{_PREFIX[sensor]}_{given}" if given in both else given

    whole = replace(
        first,
        channels=tuple(replace(r[n], name=name(s, n)) for s, r, n in places),
        columns=tuple(r.columns[r.index(n)] for _, r, n in places),
        source=f"{first.source} and {second.source}",
        history=(*first.history, {"step": "join", "gyro_log": [dict(step) for step in second.history]}),
    )
    return (
        whole,
        tuple(name(ACCELEROMETER, n) for n in accelerometer),
        tuple(name(GYRO, n) for n in gyro),
    )


def _own(options: Mapping[str, Any], sensor: str) -> dict[str, Any]:
    """The options for the file of one triad."""
    groups = {group for names in _GROUPS.values() for group in names}
    out = dict(options)
    for key in ("unit", "scale_factor"):
        given = out.get(key)
        if isinstance(given, Mapping) and set(given) <= groups:
            out[key] = next((given[g] for g in _GROUPS[sensor] if g in given), None)
    return out


def _three(recording: Recording, given: Sequence[str] | None, sensor: str) -> tuple[str, ...]:
    from allanite.recording.records import Kind

    if given is not None:
        return tuple(given)
    wanted = Kind.ACCELERATION if sensor == ACCELEROMETER else Kind.RATE
    kinds = {c.name: c.kind for c in recording.channels if c.kind is not Kind.TEMPERATURE}
    names = [n for n, kind in kinds.items() if kind is wanted] or list(kinds)
    if len(names) != 3:
        raise InputError(
            f"{recording.source} has the channels {', '.join(recording.names)}: name the three of the {sensor} with "
            f"--{sensor}"
        )
    return tuple(names)


def _refuse_other_instants(first: Recording, second: Recording) -> None:
    """Half a sample at the end is the most that their clocks may differ by."""
    n = first.n_samples
    apart = abs(first.rate / second.rate - 1) * n
    late = 0.0
    if first.start is not None and second.start is not None:
        late = abs(first.start - second.start) * 1e-9 * first.rate
    if second.n_samples == n and apart < 0.5 and late < 0.5:
        return
    rates = ", ".join(f"{r.source}: {r.n_samples} samples at {r.rate:.6g} Hz" for r in (first, second))
    if late >= 0.5:
        rates += f", begun {late / first.rate:.3g} s apart"
    raise InputError(
        f"the two logs have different sample times ({rates}): resample them to a common time first, and "
        "write one file"
    )
