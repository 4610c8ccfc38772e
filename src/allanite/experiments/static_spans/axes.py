# SPDX-License-Identifier: BSD-3-Clause
"""Which channels of a recording are the three gyros and the three accelerometers of a unit."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.recording.channel_names import for_shell, sensor_called, ways_to_units
from allanite.recording.records import Kind, Recording

__all__ = ["UnitAxes", "unit_axes"]

_WORDS = {Kind.RATE: ("gyro", "rates"), Kind.ACCELERATION: ("accelerometer", "accelerations")}


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitAxes:
    """Names of the channels x, y, z of each triad; empty where the unit has none.

    Attributes
    ----------
    gyro, accelerometer : tuple of str
        Three names, or none.
    """

    gyro: tuple[str, ...] = ()
    accelerometer: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All channels, the gyros first."""
        return self.gyro + self.accelerometer

    @property
    def triads(self) -> dict[str, tuple[str, ...]]:
        """Channels by the name of the triad, as in `allanite.recording.calibration.Calibration.channels`."""
        both = {"accelerometer": self.accelerometer, "gyro": self.gyro}
        return {name: channels for name, channels in both.items() if channels}


def unit_axes(
    recording: Recording, gyro: Sequence[str] | None = None, accelerometer: Sequence[str] | None = None
) -> UnitAxes:
    """The three gyros and the three accelerometers of a recording, in the order x, y, z.

    Parameters
    ----------
    recording : Recording
    gyro, accelerometer : sequence of str, optional
        Three names in the order x, y, z; an empty sequence: do without. By default the three channels of rates and of
        accelerations, in their order in the recording; counts and volts must be named.

    Raises
    ------
    InputError
        More or fewer than three channels of a kind and no names, names that are not three different channels, a
        channel that measures something else, or no triad at all.
    """
    axes = UnitAxes(
        gyro=_triad(recording, gyro, Kind.RATE),
        accelerometer=_triad(recording, accelerometer, Kind.ACCELERATION),
    )
    twice = sorted(set(axes.gyro) & set(axes.accelerometer))
    if twice:
        raise InputError(f"{', '.join(twice)} cannot be gyro and accelerometer at once")
    if not axes.names:
        raise InputError(
            f"neither three gyros nor three accelerometers: the recording has {_listing(recording)}"
            f"{_way_out(recording)}"
        )
    return axes


def _triad(recording: Recording, given: Sequence[str] | None, kind: Kind) -> tuple[str, ...]:
    word, plural = _WORDS[kind]
    if given is not None:
        return _checked(recording, (given,) if isinstance(given, str) else tuple(given), kind)
    names = tuple(c.name for c in recording.channels if c.kind is kind)
    if len(names) in (0, 3):
        return names
    text = f"{len(names)} channels of {plural}: {', '.join(names)}. "
    if len(names) > 3:
        raise InputError(f"{text}Say which three are x, y and z of the {word}: --{word} {_example(names)}")
    raise InputError(
        f"{text}A {word} triad has three: name them with --{word}, or leave these out with --channels (in Python: "
        f"{word}=())"
    )


def _way_out(recording: Recording) -> str:
    """What makes a triad of the channels, if anything does: units, or, of counts and volts, the names of the axes."""
    pairs = [(c.name, c.kind.value) for c in recording.channels]
    raw = [name for name, kind in pairs if kind in (Kind.COUNTS, Kind.VOLTAGE)]
    named = [(option, [n for n in raw if sensor_called(n) == option]) for option in ("gyro", "accelerometer")]
    axes = " ".join(f"--{option} {for_shell(','.join(names))}" for option, names in named if len(names) == 3)
    if not axes and len(raw) == 3:
        axes = f"--gyro {for_shell(','.join(raw))} (or --accelerometer)"
    ways = [way for way in (ways_to_units(pairs), f"name x, y and z, {axes}" if axes else "") if way]
    return f". To go on, {'; or '.join(ways)}" if ways else ""


def _checked(recording: Recording, names: tuple[str, ...], kind: Kind) -> tuple[str, ...]:
    word, _ = _WORDS[kind]
    if not names:
        return ()
    if len(names) != 3 or len(set(names)) != 3:
        raise InputError(
            f"{word} takes three different channels in the order x, y, z, not {', '.join(names)}"
        )
    fits = (kind, Kind.COUNTS, Kind.VOLTAGE, Kind.UNKNOWN)
    wrong = [n for n in names if recording[n].kind not in fits]
    if wrong:
        raise InputError(
            f"{', '.join(wrong)} cannot be axes of the {word}: the recording has {_listing(recording)}"
        )
    return names


def _example(names: Sequence[str]) -> str:
    return for_shell(",".join(names[:3]))


def _listing(recording: Recording) -> str:
    return ", ".join(f"{c.name} ({c.kind.value})" for c in recording.channels)
