# SPDX-License-Identifier: BSD-3-Clause
"""What the exporters of noise share: the channels of a study as a consumer wants them.

``axes``             channels of a triad, a parameter with its interval or its upper limit.
``walks``            the walk of a bias that has no slot for bias instability: three labelled choices.
``preamble``         the comment at the head of every file.
``options``          what is asked of a file, checked.
``formulas``         what a file makes of a number.
``slots``            a place of a file for a number.
``usage``            which programs read a file, and which number goes where.
``numbers``          the numbers of a file, and the lines in which a format holds them.
``white``            white noise alone: what simulators without a moving bias know.
``white_and_walk``   white noise and a random walk of the bias: what most filters know.
``gauss_markov``     white noise and a first-order Gauss-Markov bias: what simulators and GNSS/INS filters know.
``json_comments``    the head of a JSON file.
``writer``           the `write` of a format that is a template of these numbers.
``autopilot``        that of the two autopilots, whose numbers are lower bounds.
"""

from allanite.exporters.imu.axes import ACCELEROMETER, GYROSCOPE, SENSORS
from allanite.exporters.imu.formulas import DRIVE, SIGMA, TIME, WALK, B, Formula, K, N
from allanite.exporters.imu.gauss_markov import MarkovImu, gauss_markov_imu
from allanite.exporters.imu.options import NoiseOptions
from allanite.exporters.imu.preamble import Consumer, Remark, rate_text
from allanite.exporters.imu.slots import Slot
from allanite.exporters.imu.usage import Program, Usage
from allanite.exporters.imu.white import WhiteImu
from allanite.exporters.imu.white_and_walk import WalkImu, white_and_walk
from allanite.exporters.imu.writer import sample_writer, white_writer, writer

__all__ = [
    "ACCELEROMETER",
    "DRIVE",
    "GYROSCOPE",
    "SENSORS",
    "SIGMA",
    "TIME",
    "WALK",
    "B",
    "Consumer",
    "Formula",
    "K",
    "MarkovImu",
    "N",
    "NoiseOptions",
    "Program",
    "Remark",
    "Slot",
    "Usage",
    "WalkImu",
    "WhiteImu",
    "gauss_markov_imu",
    "rate_text",
    "sample_writer",
    "white_and_walk",
    "white_writer",
    "writer",
]
