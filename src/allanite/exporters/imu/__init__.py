# SPDX-License-Identifier: BSD-3-Clause
"""What the exporters of noise share: the channels of a study as a consumer wants them.

``axes``             channels of a triad, a parameter with its interval or its upper limit.
``walks``            the walk of a bias that has no slot for bias instability: three labelled choices.
``preamble``         the comment at the head of every file.
``options``          what is asked of a file, checked.
``numbers``          the numbers of a file, and the lines in which a format holds them.
``white_and_walk``   white noise and a random walk of the bias: what most filters know.
``gauss_markov``     white noise and a first-order Gauss-Markov bias: what simulators and GNSS/INS filters know.
``writer``           the `write` of a format that is a template of these numbers.
``autopilot``        that of the two autopilots, whose numbers are lower bounds.
"""

from allanite.exporters.imu.axes import ACCELEROMETER, GYROSCOPE, SENSORS
from allanite.exporters.imu.gauss_markov import MarkovImu, gauss_markov_imu
from allanite.exporters.imu.numbers import Slot
from allanite.exporters.imu.options import NoiseOptions
from allanite.exporters.imu.preamble import Consumer, Remark, rate_text
from allanite.exporters.imu.white_and_walk import WalkImu, white_and_walk
from allanite.exporters.imu.writer import writer

__all__ = [
    "ACCELEROMETER",
    "GYROSCOPE",
    "SENSORS",
    "Consumer",
    "MarkovImu",
    "NoiseOptions",
    "Remark",
    "Slot",
    "WalkImu",
    "gauss_markov_imu",
    "rate_text",
    "white_and_walk",
    "writer",
]
