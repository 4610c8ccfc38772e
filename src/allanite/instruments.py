# SPDX-License-Identifier: BSD-3-Clause
"""Instruments and their recording from Python: the public names of `allanite.acquisition`.

    from allanite.instruments import HP3458A, MeterSettings, capture

    capture(HP3458A("GPIB0::22::INSTR", MeterSettings(rate=32.0)), "runs/gyro", duration=3600.0)

`capture` records any object that has the methods of `Instrument`. Names load on first use, as those of `allanite` do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite import _public

if TYPE_CHECKING:
    from allanite.acquisition.capture import capture
    from allanite.acquisition.instruments import Block, Flag, Identity, Instrument, InstrumentTimeout
    from allanite.acquisition.instruments.hp3458a import HP3458A, MeterSettings
    from allanite.acquisition.instruments.hp3458a.simulated_meter import SimulatedMeter
    from allanite.acquisition.instruments.hp3458a.simulator import MeterSimulator
    from allanite.acquisition.instruments.serial_imu import Framer, SerialImu, read_description
    from allanite.acquisition.instruments.serial_imu.faults import ImuFault
    from allanite.acquisition.instruments.serial_imu.simulator import SimulatedImu
    from allanite.acquisition.instruments.simulated import SimulatedInstrument

__all__ = [
    "HP3458A",
    "Block",
    "Flag",
    "Framer",
    "Identity",
    "ImuFault",
    "Instrument",
    "InstrumentTimeout",
    "MeterSettings",
    "MeterSimulator",
    "SerialImu",
    "SimulatedImu",
    "SimulatedInstrument",
    "SimulatedMeter",
    "capture",
    "read_description",
]

_HOMES = {
    "Block": "acquisition.instruments",
    "Flag": "acquisition.instruments",
    "Framer": "acquisition.instruments.serial_imu",
    "HP3458A": "acquisition.instruments.hp3458a",
    "Identity": "acquisition.instruments",
    "ImuFault": "acquisition.instruments.serial_imu.faults",
    "Instrument": "acquisition.instruments",
    "InstrumentTimeout": "acquisition.instruments",
    "MeterSettings": "acquisition.instruments.hp3458a",
    "MeterSimulator": "acquisition.instruments.hp3458a.simulator",
    "SerialImu": "acquisition.instruments.serial_imu",
    "SimulatedImu": "acquisition.instruments.serial_imu.simulator",
    "SimulatedInstrument": "acquisition.instruments.simulated",
    "SimulatedMeter": "acquisition.instruments.hp3458a.simulated_meter",
    "capture": "acquisition.capture",
    "read_description": "acquisition.instruments.serial_imu",
}
"""Public name -> the module it lives in."""

_RENAMED: dict[str, str] = {}
"""Deprecated name -> the public name that replaces it."""


def __getattr__(name: str) -> object:
    """Import a public name from its module on first use (PEP 562)."""
    return _public(__name__, name, _HOMES, _RENAMED)


def __dir__() -> list[str]:
    return sorted(__all__)
