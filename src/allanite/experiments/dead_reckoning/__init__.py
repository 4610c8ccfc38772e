# SPDX-License-Identifier: BSD-3-Clause
"""What the noise of a unit costs a navigator: errors of unaided dead reckoning over time, by source.

``estimation``   dead_reckon(models, latitude): what a user calls.
``dynamics``     the linear error model of a level unit at rest on the Earth.
``sources``      every term and every initial error as one scalar process that enters that model.
``propagation``  exact covariances of all of them at any times.
``intervals``    from the intervals of the parameters to those of the result.
``results``      DeadReckoning, Source and InitialErrors; ``words`` their sentences.
"""

from allanite.experiments.dead_reckoning.estimation import dead_reckon
from allanite.experiments.dead_reckoning.results import (
    DeadReckoning,
    InitialErrors,
    ReckoningRemark,
    Source,
)

__all__ = ["DeadReckoning", "InitialErrors", "ReckoningRemark", "Source", "dead_reckon"]
