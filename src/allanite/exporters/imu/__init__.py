# SPDX-License-Identifier: BSD-3-Clause
"""What the exporters of noise share: the channels of a study as a consumer wants them.

``axes``             channels of a triad, a parameter with its interval or its upper limit.
``walks``            the walk of a bias that has no slot for bias instability: three labelled choices.
``preamble``         the comment at the head of every file.
``white_and_walk``   white noise and a random walk of the bias: what most filters know.
``gauss_markov``     white noise and a first-order Gauss-Markov bias: what simulators and GNSS/INS filters know.
"""

from allanite.exporters.imu.axes import ACCELEROMETER, GYROSCOPE, SENSORS
from allanite.exporters.imu.gauss_markov import MarkovImu, MarkovOptions, common_time, gauss_markov_imu
from allanite.exporters.imu.preamble import Consumer, rate_text
from allanite.exporters.imu.white_and_walk import NoiseOptions, WalkImu, white_and_walk

__all__ = [
    "ACCELEROMETER",
    "GYROSCOPE",
    "SENSORS",
    "Consumer",
    "MarkovImu",
    "MarkovOptions",
    "NoiseOptions",
    "WalkImu",
    "common_time",
    "gauss_markov_imu",
    "rate_text",
    "white_and_walk",
]
