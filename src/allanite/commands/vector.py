# SPDX-License-Identifier: BSD-3-Clause
"""The rate vector out of a log of three gyros: which logs are of that kind, and everything that its report needs."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.commands.measurement import MeasurementResult, measured_result, origin_of, overview_of
from allanite.commands.turned import judged, models_for, rates_of
from allanite.errors import InputError
from allanite.recording.channel_names import for_shell

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from allanite.experiments.rate_vector import RateVector
    from allanite.recording.records import Recording

__all__ = ["AXES", "STRETCHES", "is_vector", "vector_of"]

Advance = Callable[[float, str], None]

STRETCHES = "stretches.csv"
"""Name of the table of stretches."""

AXES = 3
"""Axes of a rate vector."""

#: A turn so close to half a turn is one of a measurement with turns [rad].
_REVERSAL = math.radians(30.0)
_MOVED = "where the sensor moved, which was left out"


def is_vector(recording: Recording, *, forced: bool, turned: bool) -> bool:
    """Whether a log is one of three axes at rest, rather than of one axis that was turned.

    Parameters
    ----------
    recording : Recording
    forced : bool
        The user says so.
    turned : bool
        The user says when it was turned, or where it pointed.

    Raises
    ------
    InputError
        Forced, and not three channels of rates; or forced, with turns.
    """
    rates = rates_of(recording)
    if not forced:
        return len(rates) == AXES and not turned
    if turned:
        raise InputError(
            "--vector is for three axes at rest: --first, --turns, --dwell, --settling, --warm-up, --temperature and "
            "--g-sensitivity apply to one turned axis"
        )
    if len(rates) != AXES:
        raise InputError(
            f"--vector needs three channels of rates, the log has {len(rates)}: {', '.join(rates)}; "
            f"{_three_of(recording, rates)}"
        )
    return True


def _three_of(recording: Recording, rates: Sequence[str]) -> str:
    """What is to be done where there are more or fewer channels of rates than axes."""
    from allanite.recording.records import Kind

    if len(rates) < AXES:
        return "leave out --vector"
    force = [c.name for c in recording.channels if c.kind is Kind.ACCELERATION]
    named = ",".join([*rates[:AXES], *(force if len(force) == AXES else ())])
    checked = " (accelerometers check the latitude)" if len(force) == AXES else ""
    return f"name the three axes, as in --channels {for_shell(named)}{checked}"


def vector_of(
    recording: Recording,
    *,
    log: str | os.PathLike[str],
    latitude: float,
    model: str | None = None,
    forced: bool = False,
    accept: Collection[str] = (),
    estimate: Mapping[str, Any] | None = None,
    command: str | None = None,
    progress: Advance | None = None,
) -> MeasurementResult:
    """The rate vector of a recording of three gyros; see `measure_rate_vector`, whose options `estimate` holds.

    Parameters
    ----------
    log : path
        Where it comes from.
    forced : bool
        Go on where the sensor was turned by half a turn, too.

    Raises
    ------
    InputError
        A sensor that was turned by half a turn, which measures the Earth better by one axis.
    DataQualityError
        A fatal finding in the quiet stretches that was not accepted.
    """
    from allanite.experiments.rate_vector import measure_rate_vector
    from allanite.views.rate_vector import rows

    advance = progress or (lambda fraction, what: None)
    part, axes = _inertial(recording), rates_of(recording)
    models, where = models_for(model, [part[name] for name in axes], mapped=False)
    options = {
        "channels": axes,
        "latitude": latitude,
        "model": models or None,
        **(estimate or {}),
    }
    vector = measure_rate_vector(part, progress=lambda done, what: advance(0.5 * done, what), **options)
    if not forced:
        _refuse_turned(vector)
    advance(0.5, "looking for faults")
    ready = judged(
        part, _moving(vector, part.rate), part.names, where=_MOVED, longest=math.inf, accept=accept
    )
    if any(f.excludes for f in ready.findings):
        vector = measure_rate_vector(ready.recording, **options)
    return measured_result(
        "rate-vector",
        vector,
        lossy=ready.lossy,
        tables={STRETCHES: rows(vector)},
        model_name=_model_name(list(where.values())),
        overviews=tuple(overview_of(part, name) for name in axes),
        **origin_of(part, ready.findings, log, command),
    )


def _inertial(recording: Recording) -> Recording:
    """Gyros, and accelerometers where there are three: nothing else matters here, nor what is wrong with it."""
    from allanite.recording.records import Kind

    force = [c.name for c in recording.channels if c.kind is Kind.ACCELERATION]
    return recording.select(*rates_of(recording), *(force if len(force) == AXES else ()))


def _refuse_turned(vector: RateVector) -> None:
    reversals = [turn for turn in vector.turns.tolist() if abs(turn - math.pi) < _REVERSAL]
    if reversals:
        times = "once" if len(reversals) == 1 else f"{len(reversals)} times"
        raise InputError(
            f"the three axes were turned by about half a turn {times}. Turns separate the biases from the "
            "Earth's rotation: choose the turned axis with --channels, and state its direction with "
            "--first north. For the magnitude of the rate vector, including the biases, use --vector"
        )


def _moving(vector: RateVector, rate: float) -> NDArray[np.int64]:
    """Samples of the stretches that were left out because the sensor moved."""
    import numpy as np

    from allanite.experiments.rate_vector.verdict import LeftOut

    spans = [(s.start, s.stop) for s in vector.left_out if s.why is not LeftOut.MISSING]
    return np.round(np.array(spans, dtype=np.float64).reshape(-1, 2) * rate).astype(np.int64)


def _model_name(names: list[str]) -> str:
    """Where the noise comes from; the file alone where each axis has a model of its own in it."""
    if len(set(names)) == 1:
        return names[0]
    return f"{Path(names[0].split(', channel')[0]).name}, one for each axis"
