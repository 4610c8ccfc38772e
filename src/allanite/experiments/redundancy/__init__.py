# SPDX-License-Identifier: BSD-3-Clause
"""More sensors of one kind than axes: one estimate of all of them, and what their disagreement tells.

    y = H x + b + e,    H the sensitive axes (n, m),   W H = 1,   V H = 0,  V V' = 1.                             (1)

W weighs the sensors, V is the parity matrix: V y does not depend on what is measured, however it moves.

``estimation``   combine(recording, directions, models): what a user calls.
``geometry``     axes, parity matrix, best weights, and which sensors no parity can tell apart.
``means``        the record as means over windows of all sensors.
``shared``       noise that the sensors share, measured on a record at rest.
``parity``       the filter that turns V y into independent numbers of variance one.
``alarms``       the tests, at a stated rate of false alarms per record.
``faults``       which fault of which sensor explains an alarm.
``combined``     the combined record, read block by block, and its noise model.
``results``      Combination and what it is made of; ``verdict`` its codes, ``words`` its sentences, ``version_1`` what
                 documents of version 1 said.
"""

from allanite.experiments.redundancy.estimation import combine
from allanite.experiments.redundancy.results import Combination, CombinedSensors, SensorFault, SharedNoise

__all__ = ["Combination", "CombinedSensors", "SensorFault", "SharedNoise", "combine"]
