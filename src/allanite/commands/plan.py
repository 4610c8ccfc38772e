# SPDX-License-Identifier: BSD-3-Clause
"""The accuracy of an Earth rate or of north before it is measured, from a model out of a file or words."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from allanite.commands.declaration import Command
from allanite.commands.option import LATITUDE, MODEL, SETUP, option
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from collections.abc import Mapping

    from allanite.commands.measurement import MeasurementResult

__all__ = ["PLAN", "plan_of"]


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalUnit:
    """A goal that is an angle goes with --north, and a share without it; as a page gives it, a number, with either.

    Attributes
    ----------
    angle : bool
        Which goals are meant.
    says : str
        The refusal.
    """

    angle: bool
    says: str

    def broken(self, given: Mapping[str, object]) -> bool:
        """Whether the goal is of the other kind."""
        return getattr(given.get("goal"), "is_angle", None) is self.angle is not ("north" in given)


PLAN = Command(
    name="plan",
    title="Plan",
    summary="Predict the accuracy of Earth rate or north before you record.",
    details=(
        "Computed by covariance analysis for each dwell and record length; no samples are needed. To plan positions "
        "for a calibration or an alignment, use `allanite plan positions`."
    ),
    example="allanite plan --model study.json --latitude -23.31 --goal 3%",
    takes="model",
    options=(
        option("model", "--model", MODEL.help, metavar="MODEL", required=True),
        option("text", "--channel", "Channel whose model to use, if there are several."),
        LATITUDE,
        option("flag", "--north", "Plan a north search instead of an Earth-rate measurement."),
        option(
            "goal", "--goal", "One standard deviation.", detail="3%, or 1deg with --north", otherwise="these"
        ),
        option("seconds", "--dead-time", "Time lost at each turn.", default=2.0),
        option("seconds-list", "--dwells", "Times between turns.", detail="10,30,5min"),
        option("seconds-list", "--durations", "Record lengths.", detail="10min,1h,2h"),
        option("integer", "--axes", "Number of horizontal axes, with --north.", default=1),
        option(
            "integer", "--positions", "Number of positions around the table, with --north.", otherwise="4"
        ),
        option("degrees", "--misalignment", "Misalignment of the axes on the table, with --north."),
        *SETUP,
    ),
    rules=(
        GoalUnit(angle=True, says="--goal is a fraction of the Earth rate, 3%; an angle needs --north"),
        GoalUnit(angle=False, says="--goal is an angle with --north, 1deg"),
    ),
    work="allanite.commands.plan:plan_of",
    tables={"plan.csv": "allanite.views.plan:rows"},
    brief=True,
)


def plan_of(
    model: str | os.PathLike[str],
    *,
    channel: str | None = None,
    north: bool = False,
    command: str | None = None,
    **options: Any,
) -> MeasurementResult:
    """A plan of the Earth rate, or of north; options are those of `stated_in` and of `plan`.

    Raises
    ------
    InputError
        Several models of rate sensors, and none chosen.
    """
    from allanite.commands.measurement import measured_result, provenance
    from allanite.commands.setup import stated_in
    from allanite.commands.turned import chosen_model
    from allanite.experiments.planning import plan
    from allanite.study.model_file import load_models
    from allanite.study.result_document import Provenance

    models, _ = load_models(model)
    rates = {name: made for name, made in models.items() if made.kind == "rate"} or models
    if channel is None and len(rates) > 1:
        raise InputError(f"{model} has several models: {', '.join(rates)}; choose one with --channel")
    if channel is not None and channel not in rates:
        raise InputError(f"{model} has no model of channel {channel!r}; there are: {', '.join(rates)}")
    name = channel or next(iter(rates))
    return measured_result(
        "plan",
        plan(rates[name], what="north" if north else "rate", stated=stated_in(options), **options),
        lossy=False,
        provenance=Provenance(**provenance("", command=command)),
        model_name=chosen_model(model, name)[1],
    )
