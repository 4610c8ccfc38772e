# SPDX-License-Identifier: BSD-3-Clause
"""Inertial sensors on a serial port, described in a YAML file: binary frames or lines of text.

``description``  what frames or lines look like (`layout`), checked as a whole (`consistency`)
``checksums``    sum8, xor, crc8, crc16-ccitt, crc32, fletcher16
``framing``      bytes in, samples out (`frames`, `lines`, `sequence`, `tally`)
``driver``       SerialImu: the instrument (`port` is the only module that knows pyserial)
``simulator``    SimulatedImu: a device on a pseudo-terminal that misbehaves on request (`encoding`, `faults`)
"""

from allanite.acquisition.instruments.serial_imu.description import Description, read_description
from allanite.acquisition.instruments.serial_imu.driver import SerialImu
from allanite.acquisition.instruments.serial_imu.framing import Framer, Samples
from allanite.acquisition.instruments.serial_imu.tally import Tally

__all__ = ["Description", "Framer", "Samples", "SerialImu", "Tally", "read_description"]
