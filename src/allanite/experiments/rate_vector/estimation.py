# SPDX-License-Identifier: BSD-3-Clause
"""From a record of three gyros at rest to the rate vector, its length and the interval of the length."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.earth_rate.verdict import EarthRateVerdict, NoiseOrigin
from allanite.experiments.rate_vector.checks import angle_between, latitude_check, pose_check, size_checks
from allanite.experiments.rate_vector.levels import LevelRows
from allanite.experiments.rate_vector.poses import find_poses, without_short
from allanite.experiments.rate_vector.results import QuietMeans, RateSpan, RateVector
from allanite.experiments.rate_vector.stretches import (
    QUIET,
    RISE,
    WHY,
    AxisCells,
    cut,
    rest,
    restless,
    settled,
)
from allanite.experiments.rate_vector.vectors import Vectors, interval_of
from allanite.experiments.rate_vector.verdict import LeftOut
from allanite.experiments.setup import setup_of
from allanite.noise import NoiseModel
from allanite.noise.given_models import models_of
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.quantities.residual_tests import SEEN
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.records import BLOCK, Kind, Recording

__all__ = ["measure_rate_vector"]

Array = NDArray[np.float64]
States = NDArray[np.int64]
Progress = Callable[[float, str], None]

#: Quiet cells beyond the number of poses that an interval needs.
LEAST = 8
#: Most means of quiet cells that a picture shows.
MOST_MEANS = 400


def measure_rate_vector(
    recording: Recording,
    *,
    channels: Sequence[str] | None = None,
    model: NoiseModel | Mapping[str, NoiseModel] | None = None,
    latitude: float | None = None,
    stated: SetupUncertainty | None = None,
    bias: float = 0.0,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> RateVector:
    """The rotation vector that a three-axis gyro at rest sees, and its length against the Earth's rate.

    Parameters
    ----------
    recording : Recording
        Of three rates, at right angles to each other; disturbed stretches are found and left out.
    channels : sequence of str, optional
        The three axes; needed where the recording has more than three rates.
    model : NoiseModel or mapping of channel name to NoiseModel, optional
        Of the sensor at rest. Where the quiet stretches contradict it, their own noise takes its place. A model that
        bounds the flicker gives the narrower interval: see Notes.
    latitude : float, optional [rad]
        With three accelerometers in the recording, the angle between gravity and the vector is checked against it.
    stated : SetupUncertainty, optional
        Uncertainties of scale factor (by default that of the channels), latitude and tilt (here that of the
        accelerometers against the gyros).
    bias : float [rad/s]
        Standard uncertainty of the bias of each axis, if it is known from elsewhere.
    confidence : float
        Of the interval.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Returns
    -------
    RateVector

    Raises
    ------
    InputError
        Not three channels of rates, a latitude, bias or confidence that makes no sense.
    DataQualityError
        An axis whose means do not vary.

    Notes
    -----
    The length of a noisy mean m of w is too long by the second order, E|m|^2 = |w|^2 + trace(C), which is removed.
    Where the sensor was turned between quiet stretches, |w|^2 is the mean of that of the poses, weighted by their time.
    The interval is Student's, and the wider one of the noise model's and that of the scatter of 8, 16 and 32 batches
    of quiet cells. Without a model the noise is averaged over what the record shows of it
    (`allanite.experiments.rate_vector.levels`): slow flicker that the record cannot exclude is in the interval, which
    is two to four times as wide as white noise alone would make it, and right where the flicker is there. Near zero the
    interval comes from inverting the non-central chi-square law with the largest variance of any direction.
    """
    _refuse(latitude, bias, confidence)
    advance = progress or (lambda fraction, what: None)
    names = _axes(recording, channels)
    given = models_of(model, {name: recording[name].kind for name in names})
    cells = cut(recording, names, lambda part: advance(0.7 * part, "reading the rates"))
    state, pose, turns = _quiet(cells)
    facts = {
        "latitude": latitude,
        "turns": turns,
        "confidence": confidence,
        **_spans(cells, state, pose, recording.duration),
        "duration": recording.duration,
        "cell": cells.dt,
        "model_source": NoiseOrigin.RECORD if model is None else NoiseOrigin.GIVEN,
        "channels": tuple(names),
        "source": recording.source,
    }
    enough = np.count_nonzero(state == QUIET) >= LEAST + len(turns)
    rise = restless(cells, state) if enough else math.inf
    if rise > RISE:
        return _nothing(facts, math.nan if math.isinf(rise) else math.sqrt(rise))
    advance(0.8, "fitting the rates")
    vectors = Vectors.of(LevelRows.of(cells, state, pose), names, [given.get(name) for name in names])
    vectors = vectors.widened(cells, state, pose, confidence)
    quiet = (state == QUIET) & (pose == vectors.longest)
    gravity = _gravity(recording, cells, quiet)
    checks = [*size_checks(vectors.size), *pose_check(vectors)]
    setup = setup_of(stated, (recording[name] for name in names))
    if gravity is not None and latitude is not None:
        checks.append(latitude_check(vectors, gravity, latitude, setup, bias))
    budget = {
        "noise": vectors.sd,
        "scale factor": setup.scale * vectors.length,
        "bias": bias,
        "resolution": _resolution(recording, names, cells, quiet, vectors),
    }
    total = math.sqrt(sum(v**2 for v in budget.values()))
    rate_vector = RateVector(
        vector=_fixed(vectors.level[vectors.longest]),
        covariance=_fixed(vectors.covariance_of(vectors.longest)),
        magnitude=Quantity.of(vectors.length, interval_of(vectors, total, confidence), "rad/s"),
        sd=vectors.sd,
        total_sd=total,
        budget=budget,
        checks=tuple(checks),
        gravity_angle=None if gravity is None else angle_between(gravity, vectors.level[vectors.longest]),
        quiet_means=_quiet_means(cells, state),
        **facts,  # type: ignore[arg-type]
    )
    return _judged(rate_vector)


def _judged(bare: RateVector) -> RateVector:
    low, high = bare.interval
    if bare.length < SEEN * bare.total_sd:
        unseen = replace(bare.magnitude, status=QuantityStatus.NOT_RESOLVED)
        return replace(bare, magnitude=unseen, verdict=EarthRateVerdict.NOT_RESOLVED)
    if not low <= EARTH_RATE <= high:
        return replace(bare, verdict=EarthRateVerdict.CONTRADICTS)
    agreed = EarthRateVerdict.INCONSISTENT if bare.contradictions else EarthRateVerdict.RESOLVED
    return replace(bare, verdict=agreed)


def _refuse(latitude: float | None, bias: float, confidence: float) -> None:
    if latitude is not None and not abs(latitude) <= math.pi / 2:
        raise InputError(f"latitude {latitude!r}: give it in radians, from -pi/2 to pi/2")
    if not (math.isfinite(bias) and bias >= 0):
        raise InputError(f"the uncertainty of the bias must be finite and not negative [rad/s], not {bias!r}")
    if not 0.5 <= confidence < 1:
        raise InputError(f"confidence must be from 0.5 to below 1, not {confidence!r}")


def _axes(recording: Recording, channels: Sequence[str] | None) -> list[str]:
    """The three channels of rates."""
    rates = [c.name for c in recording.channels if c.kind is Kind.RATE]
    names = rates if channels is None else list(channels)
    wrong = [n for n in names if recording[n].kind is not Kind.RATE]
    if len(set(names)) != 3 or wrong:
        has = ", ".join(f"{c.name} ({c.kind.value})" for c in recording.channels)
        raise InputError(
            "three axes of rates are needed, at right angles to each other, not "
            f"{', '.join(wrong or names) or 'none'}; the recording has: {has}. Say which with channels=, or give "
            "the unit, e.g. deg/s"
        )
    return names


# -- what is quiet ----------------------------------------------------------------------------------------


def _quiet(cells: AxisCells) -> tuple[States, States, Array]:
    """State and pose of each cell, and the turns between the poses."""
    state = rest(cells)
    for _ in range(2):  # a slow rotation may have looked like a turn
        state = settled(cells, state, find_poses(cells, state)[0])
    state = without_short(state, find_poses(cells, state)[0])
    pose, turns = find_poses(cells, state)
    return state, pose, _fixed(turns)


def _spans(cells: AxisCells, state: States, pose: States, duration: float) -> dict[str, tuple[RateSpan, ...]]:
    """Stretches used and left out, neighbours of one kind joined."""
    key = np.where(state == QUIET, -1 - pose, state)
    edges = np.concatenate(([0], np.flatnonzero(np.diff(key)) + 1, [len(key)]))
    used, left = [], []
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        if a == b:
            continue
        start, stop = a * cells.dt, b * cells.dt
        if state[a] == QUIET:
            used.append(RateSpan(start=start, stop=stop, pose=int(pose[a])))
        else:
            left.append(RateSpan(start=start, stop=stop, why=WHY[int(state[a])]))
    end = cells.count * cells.dt
    if duration > end * (1 + 1e-12):
        left.append(RateSpan(start=end, stop=duration, why=LeftOut.REST))
    return {"used": tuple(used), "left_out": tuple(left)}


def _quiet_means(cells: AxisCells, state: States) -> QuietMeans:
    chosen = np.flatnonzero((state == QUIET) & cells.whole)
    join = max(1, -(-len(chosen) // MOST_MEANS))
    parts = [chosen[i : i + join] for i in range(0, len(chosen), join)]
    return QuietMeans(
        time=np.array([(part.mean() + 0.5) * cells.dt for part in parts]),
        means=np.array([cells.mean[part].mean(axis=0) for part in parts]).reshape(-1, 3).T,
        joined=join,
    )


def _nothing(facts: Mapping[str, object], restlessness: float) -> RateVector:
    nan = math.nan
    return RateVector(
        magnitude=Quantity(
            value=nan, lower=0.0, upper=math.inf, unit="rad/s", status=QuantityStatus.NOT_RESOLVED
        ),
        vector=_fixed(np.full(3, nan)),
        covariance=_fixed(np.full((3, 3), nan)),
        sd=nan,
        total_sd=nan,
        restlessness=restlessness,
        **facts,  # type: ignore[arg-type]
    )


def _fixed(values: Array) -> Array:
    """A read-only copy."""
    copy = values.copy()
    copy.flags.writeable = False
    return copy


# -- gravity and resolution ---------------------------------------------------------------------------------


def _gravity(recording: Recording, cells: AxisCells, use: NDArray[np.bool_]) -> Array | None:
    """Mean specific force in the cells to use; None without three accelerometers."""
    names = [c.name for c in recording.channels if c.kind is Kind.ACCELERATION]
    if len(names) != 3:
        return None
    force = []
    for name in names:
        total = count = 0.0
        for start, samples in recording.blocks(name, cells.size * max(BLOCK // cells.size, 1)):
            whole = samples[: len(samples) // cells.size * cells.size].reshape(-1, cells.size)
            chosen = whole[use[start // cells.size :][: len(whole)]]
            total += float(np.nansum(chosen))
            count += float(np.count_nonzero(~np.isnan(chosen)))
        if count == 0:
            return None
        force.append((total / count + recording.origin(name)) * recording[name].scale)
    return np.array(force) if np.linalg.norm(force) > 0 else None


def _resolution(
    recording: Recording, names: Sequence[str], cells: AxisCells, quiet: NDArray[np.bool_], vectors: Vectors
) -> float:
    """Error of a mean of samples that noise does not carry over their steps [rad/s].

    Counted angles are no such samples: what one count leaves out the next one holds, so that the spread of their
    sub-means falls with the number of samples and not with its root.
    """
    first = int(np.argmax(quiet)) * cells.size
    step_errors = np.zeros(len(names))
    for i, name in enumerate(names):
        scale = abs(recording[name].scale)
        samples = recording.raw(name, first, first + max(BLOCK, cells.size))
        steps = np.diff(np.unique(samples[np.isfinite(samples)]))
        step = float(steps.min()) * scale if len(steps) else 0.0
        spread = float(np.nanstd(samples[: cells.size])) * scale
        energy = cells.energy[0][quiet][:, i]
        white = 2 * spread**2 * (cells.details[0] + 1) / cells.size
        stuck = np.count_nonzero(energy == 0) > 0.5 * len(energy)
        if stuck or (spread < 0.5 * step and float(np.nanmedian(energy)) > 0.5 * white):
            step_errors[i] = step / math.sqrt(12)
    return math.sqrt(float(((vectors.directions[vectors.longest] * step_errors) ** 2).sum()))
