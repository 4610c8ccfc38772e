# SPDX-License-Identifier: BSD-3-Clause
"""Instruments: wire -> blocks of samples, one module or folder for each model, none of which knows another.

A driver gives what is certain and says what is not. It never repeats a sample that it has given before, never fills
one that did not come, and leaves the decision whether to go on to the capture above it: silence is an
`InstrumentTimeout`, everything else that went wrong on the wire is a remark of the block and a flag of its samples.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError, InstrumentError
from allanite.files.store import Flag, host_ns
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import Channel

__all__ = ["Block", "Flag", "Identity", "Instrument", "InstrumentTimeout", "host_ns"]


class InstrumentTimeout(InstrumentError):
    """Nothing came within the time allowed. The instrument may answer again: ask once more, or give up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """Who answers. A changed identity after a reconnection means another recording.

    Attributes
    ----------
    maker, model : str
        Maker and model of the instrument.
    serial, firmware : str
        "" where the instrument does not tell.
    """

    maker: str
    model: str
    serial: str = ""
    firmware: str = ""

    def to_json(self) -> dict[str, str]:
        """Plain data for the header of a run."""
        return {
            "maker": self.maker,
            "model": self.model,
            "serial": self.serial,
            "firmware": self.firmware,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """Samples that came together, oldest first.

    Attributes
    ----------
    values : ndarray, shape (n_samples, n_channels) [unit of each channel]
        NaN where there is no value; `n_samples` may be 0 when only remarks came.
    flags : ndarray of uint8, shape (n_samples,)
        Bits of `Flag`. RESYNC stands at the first sample after an interruption.
    counter : ndarray of int64, shape (n_samples,), or None
        Number of the sample in intervals of the instrument; jumps where samples are missing. None: it has none.
    received_ns : int [ns]
        `host_ns` when the last sample was there.
    remarks : tuple of str
        Faults of the wire, one sentence each; normally empty.
    gap_uncertainty : float or None
        Standard uncertainty of the last jump of the counter, in this block or before it, if a clock gave the number of
        missing samples [samples]; None if they were counted.
    facts : mapping
        Facts that the instrument reported with these samples, e.g. its temperature before the first of them.
    """

    values: NDArray[np.float64]
    flags: NDArray[np.uint8]
    counter: NDArray[np.int64] | None = None
    received_ns: int = field(default_factory=host_ns)
    remarks: tuple[str, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)
    gap_uncertainty: float | None = None

    def __post_init__(self) -> None:
        n = len(self.values)
        if self.values.ndim != 2 or self.flags.shape != (n,):
            raise InputError(
                f"block: values {self.values.shape} and flags {self.flags.shape} do not match; they must "
                "be (n_samples, n_channels) and (n_samples,)"
            )
        if self.counter is not None and self.counter.shape != (n,):
            raise InputError(f"block: {n} samples but {len(self.counter)} counters")

    def __len__(self) -> int:
        return len(self.values)


@runtime_checkable
class Instrument(Protocol):
    """What the capture asks of every instrument.

    Attributes
    ----------
    channels : tuple of Channel
        Channels of the instrument.
    rate : float [Hz]
        Nominal samples per second.
    settings : mapping
        Everything that was set, as read back from the instrument where it can be; complete after `open`. Other settings
        after a reconnection, or behind a block with remarks or facts, begin another part of the run.
    device : str
        Resource that only one program may use at a time: the path of a port, an address. "" if there is none.
    """

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Names, units and scale of what is measured."""
        ...

    @property
    def rate(self) -> float:
        """Nominal samples per second [Hz]."""
        ...

    @property
    def settings(self) -> Mapping[str, object]:
        """Everything that was set, as read back; complete after `open`."""
        ...

    @property
    def device(self) -> str:
        """What must not be used by two at a time; "" where there is none."""
        ...

    def open(self) -> Identity:
        """Connect, set everything, read it back.

        Raises
        ------
        InstrumentError
            No link, another model, or a setting that the instrument did not take.
        """
        ...

    def start(self) -> None:
        """Begin to measure."""
        ...

    def read(self, timeout: float) -> Block:
        """What has come, waiting at most `timeout` seconds for the first of it.

        An instrument that must pause (its counter ends) does so inside, says so in `remarks`, and sets RESYNC on the
        next sample. `n_samples` may be 0 with remarks.

        Raises
        ------
        InstrumentTimeout
            Nothing came.
        InstrumentError
            The link is gone: `close`, then `open` and `start` again.
        """
        ...

    def interrupt(self) -> None:
        """Called from another thread: a waiting `read` ends immediately with `InstrumentTimeout`, and so do later ones.

        Until the next `start`.
        """
        ...

    def stop(self) -> None:
        """End the measurement and leave the instrument ready for others; never hangs."""
        ...

    def close(self) -> None:
        """Give the link back; may be called twice, and after a failure."""
        ...
