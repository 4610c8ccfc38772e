# SPDX-License-Identifier: BSD-3-Clause
"""Which positions, and how long in each, for a wanted standard deviation of a calibration or of a heading.

``estimation``   plan_positions(models, goals): what a user calls.
``schemes``      the 26 positions of a box, the way from one to the next, and the usual schemes.
``prediction``   the covariance of a calibration from geometry and noise models.
``search``       the scheme that reaches the goals first: greedy, exchange, dwells.
``headings``     the same for a heading, from the covariance of an alignment.
``results``      PositionPlan and what it is made of; ``verdict``, ``words`` its codes and its sentences.
"""

from allanite.experiments.position_planning.estimation import plan_positions
from allanite.experiments.position_planning.results import PlannedPosition, PositionPlan, Scheme
from allanite.experiments.position_planning.verdict import PositionPlanRemark, PositionPlanVerdict

__all__ = [
    "PlannedPosition",
    "PositionPlan",
    "PositionPlanRemark",
    "PositionPlanVerdict",
    "Scheme",
    "plan_positions",
]
