# SPDX-License-Identifier: BSD-3-Clause
"""Which of the noise models that were given belongs to which channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from allanite.errors import InputError
from allanite.noise import NoiseModel
from allanite.recording.records import Kind

__all__ = ["models_of"]

#: Roles of channels of these kinds, where nobody says more.
_ROLES = {Kind.RATE: "gyro", Kind.ACCELERATION: "accelerometer"}


def models_of(
    model: NoiseModel | Mapping[str, NoiseModel] | None,
    kinds: Mapping[str, Kind],
    *,
    roles: Mapping[str, Sequence[str]] | None = None,
    needed: bool = True,
) -> dict[str, NoiseModel]:
    """The noise model of each channel.

    Parameters
    ----------
    model : NoiseModel or mapping of str to NoiseModel, optional
        One for all channels of its kind, or by name of the channel, or by role: "gyro", "accelerometer". A name goes
        before a role. None: no channel has one.
    kinds : mapping of str to Kind
        What each channel measures. `Kind.UNKNOWN` fits every model.
    roles : mapping of str to sequence of str, optional
        Channels by role; by default those of rates are gyros, those of accelerations accelerometers.
    needed : bool
        Refuse where a channel has none; else leave it out.

    Returns
    -------
    dict of str to NoiseModel
        In the order of the channels.

    Raises
    ------
    InputError
        A model is missing or of another kind of sensor, or one alone could be that of gyros and of accelerometers.
    """
    if model is None:
        return {}
    if roles is None:
        role_of = {name: _ROLES[kind] for name, kind in kinds.items() if kind in _ROLES}
    else:
        role_of = {name: role for role, names in roles.items() for name in names}
    if isinstance(model, NoiseModel):
        models = _of_its_kind(model, kinds, role_of)
    else:
        by_channel = {name: model.get(name, model.get(role_of.get(name, name))) for name in kinds}
        models = {name: given for name, given in by_channel.items() if given is not None}
        _refuse_other_kinds(models, kinds)
    missing = [name for name in kinds if name not in models]
    if missing and needed:
        raise InputError(
            f"no noise model for {', '.join(missing)}{_instead(model, [kinds[n] for n in missing])}"
        )
    return models


def _instead(model: NoiseModel | Mapping[str, NoiseModel], kinds: Sequence[Kind]) -> str:
    """What was given to channels that have no model."""
    if isinstance(model, NoiseModel):
        others = " or ".join(dict.fromkeys(kind.value for kind in kinds))
        return f": the given one is of {model.kind}, not of {others}"
    return f"; there are: {', '.join(model) or 'none'}. Name models like the channels, or 'gyro' and 'accelerometer'"


def _of_its_kind(
    model: NoiseModel, kinds: Mapping[str, Kind], role_of: Mapping[str, str]
) -> dict[str, NoiseModel]:
    names = [name for name, kind in kinds.items() if _fits(model, kind)]
    if len({role_of.get(name, "") for name in names}) > 1:
        raise InputError(
            "one noise model cannot apply to accelerometers and gyros: pass one by channel, for "
            f"{', '.join(names)}, or by role, for 'gyro' and 'accelerometer'"
        )
    return dict.fromkeys(names, model)


def _refuse_other_kinds(models: Mapping[str, NoiseModel], kinds: Mapping[str, Kind]) -> None:
    for name, model in models.items():
        if not _fits(model, kinds[name]):
            raise InputError(
                f"the noise model of {name!r} is of {model.kind}, not of {kinds[name].value}: state it in "
                "the unit of the channel, or pass the scale factor of the data sheet with the record"
            )


def _fits(model: NoiseModel, kind: Kind) -> bool:
    return kind is Kind.UNKNOWN or model.kind == kind.rate
