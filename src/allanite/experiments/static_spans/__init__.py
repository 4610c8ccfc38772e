# SPDX-License-Identifier: BSD-3-Clause
"""When is a hand-moved unit at rest? Static spans of a log of three gyros, three accelerometers, or both.

``axes``       which channels are the triads.
``cells``      the record in pieces of a twentieth of a second.
``floor``      how much a sensor at rest moves, from a record most of which may be disturbed.
``scan``       windows of many lengths against the noise: of a model, or the record's own.
``scrutiny``   what has no spread and is no rest: frozen samples, even rotations, a hand that holds still.
``detection``  the spans.
``hand``       the rests of a unit that is held in the hand.
``choice``     put down or held: whose spans a calibration takes.
``given``      spans that the user knows.
"""

from allanite.experiments.static_spans.axes import UnitAxes, unit_axes
from allanite.experiments.static_spans.choice import find_rests, held_by_hand
from allanite.experiments.static_spans.detection import find_static_spans
from allanite.experiments.static_spans.given import given_spans, read_spans
from allanite.experiments.static_spans.hand import find_held_spans
from allanite.experiments.static_spans.means import PositionMeans, SdColumns, SdOf, means_of
from allanite.experiments.static_spans.results import WHY, Level, MovingSpan, StaticSpan, StaticSpans

__all__ = [
    "WHY",
    "Level",
    "MovingSpan",
    "PositionMeans",
    "SdColumns",
    "SdOf",
    "StaticSpan",
    "StaticSpans",
    "UnitAxes",
    "find_held_spans",
    "find_rests",
    "find_static_spans",
    "given_spans",
    "held_by_hand",
    "means_of",
    "read_spans",
    "unit_axes",
]
