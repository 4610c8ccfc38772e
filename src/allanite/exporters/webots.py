# SPDX-License-Identifier: BSD-3-Clause
"""Gyro and Accelerometer nodes of Webots with a lookup table that has the noise of a sample.

WbLookupTable interpolates output and noise between its rows, and gives output (1 + noise g), g normal: the noise is a
share of the output, and a sensor that reads zero has none. So the output of this table is shifted far from zero, by an
offset that the controller subtracts: noise = deviation/output is then the deviation, within 1e-6 of it.
"""

from __future__ import annotations

from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    Consumer,
    N,
    Program,
    Slot,
    Usage,
    WhiteImu,
    white_writer,
)

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "webots"
FILE_NAME = "webots_imu.wbt"
SUMMARY = (
    "Webots: lookupTable of Gyro and Accelerometer, shifted so that its noise is that of one sample; no walk"
)
TAKES = "study"

#: Node, range, offset and unit of a triad.
_NODES = {
    GYROSCOPE: ("Gyro", 100.0, 1e5, "rad/s"),
    ACCELEROMETER: ("Accelerometer", 1000.0, 1e6, "m/s^2"),
}
USAGE = Usage(
    programs=(Program("Webots", "cyberbotics/webots: src/webots/nodes/WbLookupTable.cpp"),),
    slots=tuple(
        Slot(f"{node}.lookupTable", sensor, N.of_a_sample.times(1 / offset, f"{1 / offset:.0e}"), "1")
        for sensor, (node, _, offset, _) in _NODES.items()
    ),
    trap="the third column is relative to the output: with the usual table a sensor at rest has no noise. SUBTRACT THE "
    "OFFSET in the controller",
    lost="bias instability and random walk: the bias is zero",
)
CONSUMER = Consumer(
    name="Webots",
    file=FILE_NAME,
    usage=USAGE,
    convention=(
        "input, output and noise of a row: output = input + offset, noise = N sqrt(f)/output, f = 1/samplingPeriod",
    ),
    simulator=True,
    terms=("N",),
)
TERMS = CONSUMER.terms


def _template(imu: WhiteImu, rate: float) -> list[str]:
    """The nodes; their tables go into the nodes of a robot."""
    lines = imu.comment()
    for slot, (node, span, offset, unit) in zip(USAGE.slots, _NODES.values(), strict=True):
        lines += ["", f"# {node}: subtract {offset:.0f} {unit} from its values in the controller"]
        if slot.sensor not in imu.noise:
            lines.append(f"# {node} {{ lookupTable [ ] }}  # not in the study: fill in, or it has no noise")
            continue
        (share,) = imu.values(slot, rate)
        rows = [
            f"    {imu.text(x)} {x + offset:.1f} {imu.text(share * offset / (x + offset))}"
            for x in (-span, 0.0, span)
        ]
        lines += [f"{node} {{", "  lookupTable [", *rows, "  ]", "}"]
    return lines


write = white_writer(_template, CONSUMER)
