# SPDX-License-Identifier: BSD-3-Clause
"""What does not depend on the samples: the channels of the unit, where they point, their noise models, the place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

from allanite.errors import InputError
from allanite.experiments.alignment.known import Sensors
from allanite.experiments.alignment.results import OtherChannels
from allanite.experiments.static_spans import UnitAxes, unit_axes
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.given_models import models_of
from allanite.quantities.attitude import axes_matrix
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration
from allanite.recording.channel_names import ways_to_units
from allanite.recording.records import Kind, Recording

__all__ = ["AlignmentSetting", "UnitFrame", "frame_of", "unit_of"]

_KINDS = {GYRO: Kind.RATE, ACCELEROMETER: Kind.ACCELERATION}
_SI = {GYRO: "rad/s", ACCELEROMETER: "m/s²"}


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitFrame:
    """The unit.

    Attributes
    ----------
    gyro, accelerometer : tuple of str
        Channels.
    axes : str
    latitude : float [rad]
    models : pair of sequences of NoiseModel or None
        Of the gyros and of the accelerometers.
    """

    gyro: tuple[str, ...]
    accelerometer: tuple[str, ...]
    axes: str
    latitude: float
    models: tuple[Sequence[NoiseModel | None], Sequence[NoiseModel | None]] = field(repr=False)

    @property
    def given_models(self) -> dict[str, NoiseModel]:
        """By channel, where one was given."""
        both = zip((self.gyro, self.accelerometer), self.models, strict=True)
        return {
            n: m
            for names, triad_models in both
            for n, m in zip(names, triad_models, strict=True)
            if m is not None
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentSetting:
    """What the user says: the frame, what is known of the sensors and of the set-up.

    Attributes
    ----------
    frame : UnitFrame
    sensors : Sensors
    stated : SetupUncertainty
    height : float [m]
    confidence : float
    other_channels : tuple of OtherChannels
        Triads whose channels are not those of the calibration.
    """

    frame: UnitFrame
    sensors: Sensors
    stated: SetupUncertainty
    height: float
    confidence: float
    other_channels: tuple[OtherChannels, ...] = ()


def unit_of(
    recording: Recording,
    calibration: Calibration | None = None,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
) -> tuple[UnitAxes, tuple[OtherChannels, ...]]:
    """Channels of both triads: as they are named, else those of the calibration, else by their kinds.

    Returns
    -------
    UnitAxes
    tuple of OtherChannels
        Triads whose channels are not those of the calibration.

    Raises
    ------
    InputError
        A triad is missing, or its channels are in a unit that the calibration is not of.
    """
    named = {} if calibration is None else calibration.channels
    chosen = [
        given if given is not None else _here(recording, named.get(sensor, ()))
        for given, sensor in ((gyro, GYRO), (accelerometer, ACCELEROMETER))
    ]
    unit = unit_axes(recording, *chosen)
    if not (unit.gyro and unit.accelerometer):
        raise InputError(
            "an alignment needs three gyros and three accelerometers; the recording has "
            f"{', '.join(f'{c.name} ({c.kind.value})' for c in recording.channels)}"
        )
    _refuse_other_units(recording, unit, calibration)
    return unit, tuple(
        OtherChannels(calibrated=tuple(named[s]), taken=tuple(names))
        for s, names in unit.triads.items()
        if named.get(s) and tuple(named[s]) != names
    )


def _here(recording: Recording, names: Sequence[str]) -> Sequence[str] | None:
    return names if names and set(names) <= set(recording.names) else None


def _refuse_other_units(recording: Recording, unit: UnitAxes, calibration: Calibration | None) -> None:
    """Samples mean something in SI, or in the unit that the calibration is of."""
    for sensor, names in unit.triads.items():
        channel = recording[names[0]]
        calibrated = calibration is not None and sensor in calibration.sensors
        of = calibration.units.get(sensor, "") if calibration is not None and calibrated else _SI[sensor]
        in_si = channel.kind is _KINDS[sensor]
        if calibrated and of and (of == _SI[sensor]) != in_si:
            raise InputError(
                f"the calibration of the {sensor} is for samples in {of}, and {names[0]!r} is one of "
                f"{channel.kind.value}: it is not that of this log, or the log was read in another unit"
            )
        if sensor == GYRO and not in_si and not calibrated:
            raise InputError(
                f"channel {names[0]!r} is one of {channel.kind.value}: the Earth turns by 15 deg/h, so that a scale is "
                f"needed: {ways_to_units([(n, recording[n].kind.value) for n in names])}; or give a calibration of "
                "this unit in counts"
            )


def frame_of(
    recording: Recording,
    unit: UnitAxes,
    model: NoiseModel | Mapping[str, NoiseModel] | None,
    axes: str,
    latitude: float,
) -> UnitFrame:
    """The unit with its models.

    Raises
    ------
    InputError
        Axes that are none, a model of another kind of sensor, or models of none of the channels.
    """
    axes_matrix(axes)
    if isinstance(model, Mapping) and not set(model) & {*unit.names, GYRO, ACCELEROMETER}:
        raise InputError(
            f"no noise model for {', '.join(unit.names)}; there are: {', '.join(model) or 'none'}. Name models like "
            "the channels, or 'gyro' and 'accelerometer'"
        )
    return UnitFrame(
        gyro=unit.gyro,
        accelerometer=unit.accelerometer,
        axes=axes.upper(),
        latitude=latitude,
        models=(
            _models(model, unit.gyro, GYRO, recording[unit.gyro[0]].kind),
            _models(model, unit.accelerometer, ACCELEROMETER, recording[unit.accelerometer[0]].kind),
        ),
    )


def _models(
    model: NoiseModel | Mapping[str, NoiseModel] | None, channels: Sequence[str], role: str, kind: Kind
) -> list[NoiseModel | None]:
    """The models of a triad: of all three channels, or of none."""
    kinds, roles = dict.fromkeys(channels, kind), {role: channels}
    some = models_of(model, kinds, roles=roles, needed=False)
    models_by_channel = models_of(model, kinds, roles=roles) if some else {}
    return [models_by_channel.get(name) for name in channels]
