# SPDX-License-Identifier: BSD-3-Clause
"""What is known of a run before its first sample: channels, rate, instrument, and everything that was set."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, field, fields
from typing import Any, Final

from allanite import __version__
from allanite.errors import FormatError, InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.limits import COLUMNS, refuse_more
from allanite.recording.checked_samples import checked_rate
from allanite.recording.records import Channel

__all__ = ["TAKEN", "Header"]

#: Columns of a segment beside the channels.
TAKEN: Final = ("counter", "monotonic_ns", "flags")


@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """What every segment of a run begins with.

    Attributes
    ----------
    channels : tuple of Channel
        Names, units, scale factors and sampling; their order is that of the values of a `Batch`.
    rate : float [Hz]
        Nominal: what the sample clock of the instrument was told.
    instrument : mapping
        Maker, model, serial number, firmware.
    settings : mapping
        Everything that was set, as it was read back; plain data.
    aperture : float or None [s]
        Time over which the instrument averages a sample.
    scale_date : str or None
        When the scale factors were determined, as a date (ISO 8601).
    software : str
        Version of allanite that wrote the run.
    """

    channels: tuple[Channel, ...]
    rate: float
    instrument: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    aperture: float | None = None
    scale_date: str | None = None
    software: str = __version__

    def __post_init__(self) -> None:
        object.__setattr__(self, "channels", tuple(self.channels))
        object.__setattr__(self, "rate", checked_rate(self.rate))
        refuse_more(
            len(self.channels),
            COLUMNS,
            "channels",
            "the header of a run",
            "Record fewer, or several runs side by side",
        )
        names = [c.name for c in self.channels]
        if not names or len({*names, *TAKEN}) != len(names) + len(TAKEN):
            raise InputError(
                f"channel names of a run must differ from each other and from {', '.join(TAKEN)}; got {names}"
            )
        try:
            plain = json.loads(json.dumps([self.instrument, self.settings], allow_nan=False))
        except (TypeError, ValueError) as error:
            raise InputError(
                f"instrument and settings of a run must be plain data (texts, numbers, lists): {error}"
            ) from None
        object.__setattr__(self, "instrument", plain[0])  # as it will come back: tuples are lists
        object.__setattr__(self, "settings", plain[1])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(c.name for c in self.channels)

    def differences(self, other: Header) -> list[str]:
        """What is not the same in two headers, in words."""
        differing = []
        for one in fields(self):
            here, there = getattr(self, one.name), getattr(other, one.name)
            if isinstance(here, Mapping):
                keys = sorted(k for k in {*here, *there} if here.get(k) != there.get(k))
                differing += [f"{one.name}.{k}: {here.get(k)} → {there.get(k)}" for k in keys]
            elif one.name == "channels":
                pairs = zip(here, there, strict=False)
                differing += [f"channel {a.name}: {a} → {b}" for a, b in pairs if a != b]
                differing += [f"{len(here)} → {len(there)} channels"] if len(here) != len(there) else []
            elif here != there:
                differing.append(f"{one.name}: {here} → {there}")
        return differing

    def to_json(self) -> dict[str, Any]:
        """Plain data for a segment and for the manifest."""
        return asdict(self) | {"channels": [c.to_json() for c in self.channels]}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Header:
        """Inverse of `to_json`; keys of later versions are left out.

        Raises
        ------
        FormatError
            Something that every header has is missing or of the wrong form.
        """
        known = {f.name for f in fields(cls)}
        try:
            channels = tuple(Channel.from_json(c) for c in data["channels"])
            return cls(**{**{k: v for k, v in data.items() if k in known}, "channels": channels})
        except (KeyError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
            raise FormatError(f"the header of a run is damaged ({type(error).__name__}: {error})") from None
