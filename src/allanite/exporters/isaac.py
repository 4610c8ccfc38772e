# SPDX-License-Identifier: BSD-3-Clause
"""Noise of an IMU of Isaac Lab or Isaac Sim, as a Python module (standard deviations of one sample in SI, per axis).

GaussianNoiseCfg of Isaac Lab adds noise of its std to every observation; the bias of NoiseModelWithAdditiveBiasCfg is
drawn at a reset and stays (isaaclab/utils/noise). The IMU sensor of Isaac Sim has no noise: `add_to` adds it.
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

NAME = "isaac"
FILE_NAME = "isaac_imu.py"
SUMMARY = "Isaac Lab and Isaac Sim: standard deviations of one sample, for GaussianNoiseCfg; no walk"
TAKES = "study"
USAGE = Usage(
    programs=(
        Program("Isaac Lab", "isaac-sim/IsaacLab: source/isaaclab/isaaclab/utils/noise/noise_cfg.py"),
        Program("Isaac Sim", "docs.isaacsim.omniverse.nvidia.com: IMU sensor, its properties"),
    ),
    slots=(
        Slot("GYROSCOPE", GYROSCOPE, N.of_a_sample, "rad/s"),
        Slot("ACCELEROMETER", ACCELEROMETER, N.of_a_sample, "m/s^2"),
    ),
    trap="use the rate of the observations, 1/(sim.dt decimation), not of the physics; a density is far too small",
    lost="bias instability and random walk: the bias of Isaac Lab stays until a reset, and Isaac Sim has none",
)
CONSUMER = Consumer(
    name="Isaac Lab and Isaac Sim",
    file=FILE_NAME,
    usage=USAGE,
    convention=("std = N sqrt(f)",),
    per_axis=True,
    simulator=True,
    terms=("N",),
)
TERMS = CONSUMER.terms

_END = '''

def noise(std):
    """Noise of an observation of Isaac Lab: ObservationTermCfg(func=imu_ang_vel, noise=noise(GYROSCOPE))."""
    import torch
    from isaaclab.utils.noise import GaussianNoiseCfg

    return GaussianNoiseCfg(mean=0.0, std=torch.tensor(std), operation="add")


def add_to(reading, std, rng):
    """A reading of the IMU sensor of Isaac Sim with its noise; rng is a numpy.random.Generator."""
    return [value + rng.normal(0.0, deviation) for value, deviation in zip(reading, std)]
'''


def _template(imu: WhiteImu, rate: float) -> list[str]:
    """A Python module: the deviations of x, y and z, and what uses them."""
    lines = imu.lines(USAGE.slots, "{key} = {row}  # {unit}", "# {key} = []  # {unit}", rate=rate)
    return [*imu.comment(), "", *lines, *_END.splitlines()]


write = white_writer(_template, CONSUMER)
