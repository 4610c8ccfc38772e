# SPDX-License-Identifier: BSD-3-Clause
"""Telemetry logs as ground stations write them: packets of pymavlink, each with the time of its arrival before it."""

from __future__ import annotations

import numpy as np

N = 60
RAW = np.random.default_rng(7).integers(-900, 900, (N, 6))


def telemetry(version: int, *, inertial: bool = True) -> bytes:
    """A log of heartbeats and, if wanted, of inertial messages 50 ms apart."""
    from pymavlink.dialects.v10 import common as one
    from pymavlink.dialects.v20 import common as two

    library = {1: one, 2: two}[version]
    sender = library.MAVLink(None, srcSystem=1, srcComponent=1)
    content = b""
    for k, row in enumerate(RAW):
        gyro, acc, ms = row[:3].tolist(), row[3:].tolist(), 1000 + 50 * k
        messages = [library.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3)]
        if inertial:
            si = [0.00980665 * v for v in acc], [1e-3 * v for v in gyro]
            messages += [
                library.MAVLink_raw_imu_message(1000 * ms, *acc, *gyro, 0, 0, 0),
                library.MAVLink_scaled_imu2_message(ms, *acc, *gyro, 0, 0, 0),
                library.MAVLink_highres_imu_message(1000 * ms, *si[0], *si[1], 0, 0, 0, 0, 0, 0, 25.0, 63),
            ]
        for message in messages:
            content += (1_760_000_000_000_000 + 1000 * ms).to_bytes(8, "big") + bytes(message.pack(sender))
    return content
