# SPDX-License-Identifier: BSD-3-Clause
"""Finding north: the azimuth of a table from the Earth's rotation on one or two horizontal axes that turn with it.

    axis i measures H cos(psi + theta_i(t)) + level_i + noise_i,    H = Omega cos(latitude),

psi being the azimuth of the table's mark and theta_i the heading of the axis relative to the mark. Two opposite
positions need two axes; three positions and more, or continuous rotation, need one.

``tracks``      a record as block means, with the heading of each axis in each block.
``solution``    the vector H (cos psi, sin psi) by regression in the noise of each axis.
``circle``      directions, their arcs, and the interval that holds at every signal to noise.
``scatter``     the means of the positions: the second method.
``budget``      what errors of scale factor, alignment, tilt and heading do to the azimuth.
``estimation``  find_north.
``null_test``   east_west_null: does a bias follow the turns?
``verdict``, ``checks``, ``words``  what is said of both: codes, questions, sentences.

For a rate known to 0.001 deg/h (standard deviation) the azimuth is known to:

    ================  =======  =======  =======  =======  =======  =======
    latitude [deg]       0        45       60       80       89     89.99
    azimuth [deg]      0.0038   0.0054   0.0076   0.0219   0.218     21.8
    ================  =======  =======  =======  =======  =======  =======
"""

from allanite.experiments.north.circle import Arc, mean_direction
from allanite.experiments.north.estimation import find_north
from allanite.experiments.north.null_test import east_west_null
from allanite.experiments.north.results import EastWestNull, NorthEstimate, RunningNorth
from allanite.experiments.north.tracks import Rotation

__all__ = [
    "Arc",
    "EastWestNull",
    "NorthEstimate",
    "Rotation",
    "RunningNorth",
    "east_west_null",
    "find_north",
    "mean_direction",
]
