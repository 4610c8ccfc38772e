# SPDX-License-Identifier: BSD-3-Clause
"""From a turned recording of one or two horizontal axes to the azimuth of the table."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.north.budget import axis_terms
from allanite.experiments.north.checks import NorthCheck
from allanite.experiments.north.circle import (
    CIRCLE,
    Arc,
    direction_set,
    half_width,
    length_interval,
    seen_from,
    wrapped,
)
from allanite.experiments.north.results import NorthEstimate, RunningNorth
from allanite.experiments.north.scatter import PositionScatter, scatter_of
from allanite.experiments.north.solution import NorthSolution, solve
from allanite.experiments.north.tracks import Axes, Rotation, Track, axes_of, tracks_of
from allanite.experiments.north.verdict import NorthCheckKind, NorthVerdict
from allanite.experiments.reversals import Reversals
from allanite.experiments.setup import setup_of
from allanite.noise import NoiseModel
from allanite.noise.given_models import models_of
from allanite.quantities.earth import EARTH_RATE, checked_latitude
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.quantities.residual_tests import SEEN, alarm, grave, inflation_of, scatter_check, size_check
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.records import Recording

__all__ = ["check_latitude", "find_north"]

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

#: Most rows of the running estimate.
CHECKPOINTS = 400


def find_north(
    recording: Recording,
    *,
    model: NoiseModel | Mapping[str, NoiseModel],
    latitude: float,
    positions: Reversals | None = None,
    rotation: Rotation | None = None,
    channels: Axes | None = None,
    stated: SetupUncertainty | None = None,
    misalignment: float = 0.0,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> NorthEstimate:
    """The azimuth of a table from the Earth's rotation on one or two horizontal axes that were turned with it.

    Parameters
    ----------
    recording : Recording
        Record of rates with a unit.
    model : NoiseModel, or mapping of channel name to NoiseModel
        Noise models of the sensors at rest.
    latitude : float [rad]
        Short of the poles, where north is undefined.
    positions : Reversals, optional
        Dwells with the heading of the first axis relative to a mark on the table (or to the direction that the table
        calls zero), from `read_positions` for example. Two opposite positions suffice for two axes; one axis needs
        at least three that do not lie on one line.
    rotation : Rotation, optional
        Continuous rotation of the table, in place of positions.
    channels : str, sequence of str, or mapping of str to float [rad]
        Axes in the horizontal plane; of several the heading of each less that of the first, from north over east: an
        axis to the right of the first has pi/2, one to the left -pi/2. By default the only channel of rates.
    stated : SetupUncertainty, optional
        Uncertainties of scale factor (by default that of the channels), latitude, tilt and headings; the tilt here is
        that towards the east as well as that towards the north, the heading that of each position, or of the start of
        a rotation.
    misalignment : float [rad]
        Standard uncertainty of the direction of each axis on the table.
    confidence : float
        Confidence level of the intervals.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Returns
    -------
    NorthEstimate

    Raises
    ------
    InputError
        A latitude at a pole, neither positions nor a rotation, channels that are no rates, no usable samples.

    Notes
    -----
    Axis i measures H cos(psi + theta_i(t)) + level_i + noise_i, H = Omega cos(latitude); H is not taken from the
    latitude but fitted. The interval of psi holds the truth with the stated probability or up to 0.013 more at every
    signal to noise (`allanite.experiments.north.circle`); it is the whole circle where no signal is seen, also where
    less is seen than the Earth must give. Excess scatter of the positions (p < 0.01) or of the noise (p < 0.001) widens
    it. A bias that turns with the table exactly as the Earth does is found by nothing but the length of the vector, or
    by `east_west_null`.
    """
    check_latitude(latitude)
    if not (math.isfinite(misalignment) and misalignment >= 0):
        raise InputError(f"misalignment must be finite and not negative [rad], not {misalignment!r}")
    seen_from(confidence)  # refuses a confidence that makes no sense
    advance = progress or (lambda fraction, what: None)
    axes = axes_of(recording, channels)
    models = models_of(model, {name: recording[name].kind for name in axes})
    advance(0.0, "averaging")
    tracks = tracks_of(recording, axes, models, positions, rotation)
    advance(0.5, "fitting the Earth's rotation")
    rows = _checkpoints(tracks[0])
    solution = solve(tracks, rows.tolist())
    advance(0.8, "checking the residuals")
    scatter = scatter_of(tracks)
    checks = _checks(solution, scatter)
    setup = setup_of(stated, (recording[name] for name in axes))
    estimate = _estimate(tracks, solution, scatter, checks, latitude, setup, misalignment, confidence)
    estimate = replace(
        estimate,
        running=_running(solution, rows, tracks[0].blocks.dt, inflation_of(checks)),
        models=models,
        reversals=positions,
        rotation=rotation,
        duration=recording.duration,
        source=recording.source,
    )
    return replace(estimate, verdict=_verdict(estimate))


def _verdict(estimate: NorthEstimate) -> NorthVerdict:
    if estimate.components == 0:
        return NorthVerdict.NO_NORTH
    if estimate.components == 1:
        return NorthVerdict.NOT_RESOLVED if estimate.interval else NorthVerdict.CONTRADICTS
    if grave(estimate.checks):
        return NorthVerdict.INCONSISTENT
    if estimate.anywhere:
        return NorthVerdict.NO_NORTH
    if estimate.excludes_earth:
        return NorthVerdict.CONTRADICTS
    return NorthVerdict.NOT_RESOLVED if estimate.signal_to_noise < SEEN else NorthVerdict.RESOLVED


def check_latitude(latitude: float) -> None:
    """Refuses the poles.

    Raises
    ------
    InputError
        North is undefined there.
    """
    checked_latitude(latitude)


def _checkpoints(track: Track) -> NDArray[np.int64]:
    """Blocks by which dwells end, or evenly through a rotation."""
    if track.reversals is None:
        return np.unique(np.linspace(0, track.blocks.size, 201)[1:].astype(np.int64))
    rate, blocks = track.reversals.rate, track.blocks
    stops = np.array([d.stop for d in track.reversals.dwells]) / rate / blocks.dt
    rows = np.minimum(np.ceil(stops - 1e-9), blocks.size).astype(np.int64)
    return rows[::-1][:: max(len(rows) // CHECKPOINTS, 1)][::-1]


def _checks(solution: NorthSolution, scatter: PositionScatter | None) -> tuple[NorthCheck, ...]:
    checks = [NorthCheck.of(NorthCheckKind.SIZE, size_check(solution.chi2, solution.dof))]
    if solution.rank == 2:
        checks.append(NorthCheck.of(NorthCheckKind.CONSTANCY, alarm("constancy", solution.drift, 2)))
    if scatter is not None and scatter.dof > 0:
        test = scatter_check("positions", scatter.chi2, scatter.dof)
        checks.append(NorthCheck.of(NorthCheckKind.SCATTER, test))
    return tuple(checks)


def _estimate(
    tracks: Sequence[Track],
    solution: NorthSolution,
    scatter: PositionScatter | None,
    checks: tuple[NorthCheck, ...],
    latitude: float,
    stated: SetupUncertainty,
    misalignment: float,
    confidence: float,
) -> NorthEstimate:
    """All but what comes from the record, and the verdict."""
    expected = EARTH_RATE * math.cos(latitude)
    inflation = inflation_of(checks)
    blank = NorthEstimate(
        azimuth=math.nan,
        sd=math.inf,
        total_sd=math.inf,
        interval=(CIRCLE,),
        confidence=confidence,
        verdict=NorthVerdict.NO_NORTH,
        inflation=inflation,
        signal_to_noise=0.0,
        horizontal=Quantity(
            value=math.nan, lower=0.0, upper=math.inf, unit="rad/s", status=QuantityStatus.NOT_RESOLVED
        ),
        horizontal_sd=math.inf,
        expected_rate=expected,
        candidates=(),
        biases={t.name: level for t, level in zip(tracks, solution.levels, strict=True)},
        running=RunningNorth(
            time=np.zeros(0), azimuth=np.zeros(0), sd=np.zeros(0), horizontal_rate=np.zeros(0)
        ),
        checks=checks,
        latitude=latitude,
        axes={t.name: t.offset for t in tracks},
        models={},
        duration=0.0,
        block=tracks[0].blocks.dt,
        source="",
    )
    covariance = solution.covariance * inflation**2
    if solution.rank == 2:
        return _located(blank, solution, covariance, scatter, stated, misalignment)
    return _mirrored(blank, solution, covariance, stated) if solution.rank == 1 else blank


def _located(
    blank: NorthEstimate,
    solution: NorthSolution,
    covariance: Array,
    scatter: PositionScatter | None,
    stated: SetupUncertainty,
    misalignment: float,
) -> NorthEstimate:
    """Both components are seen."""
    vector, confidence = solution.vector, blank.confidence
    length = float(np.hypot(*vector))
    psi = wrapped(math.atan2(vector[1], vector[0]))
    along, across = (np.array(u) for u in ((math.cos(psi), math.sin(psi)), (-math.sin(psi), math.cos(psi))))
    sd = math.sqrt(across @ covariance @ across) / length if length > 0 else math.inf
    scale, turned = axis_terms(solution.information, psi)
    budget = {
        "noise": sd,
        "scale factor": scale * stated.scale,
        "misalignment": turned * misalignment,
        "tilt": abs(math.tan(blank.latitude)) * stated.tilt,
        "heading": (1.0 if scatter is None else scatter.heading_term(psi)) * stated.heading,
        "latitude": 0.0,  # the direction does not depend on it
    }
    more = math.sqrt(sum(v**2 for name, v in budget.items() if name != "noise"))
    arc = direction_set(vector, covariance, confidence, more)
    noise, reference = math.sqrt(along @ covariance @ along), _reference_sd(blank, stated)
    low, high = _length(length, noise, reference, confidence)
    signal = math.sqrt(vector @ np.linalg.solve(covariance, vector))
    if high < blank.expected_rate and signal < SEEN:
        arc = CIRCLE  # less than the Earth must give: what is seen is not it
    return replace(
        blank,
        azimuth=psi,
        sd=sd,
        total_sd=math.hypot(sd, more),
        interval=(arc,),
        signal_to_noise=signal,
        horizontal=Quantity.of(length, (low, high), "rad/s"),
        horizontal_sd=math.hypot(noise, reference),
        candidates=(psi,),
        budget=budget,
    )


def _reference_sd(blank: NorthEstimate, stated: SetupUncertainty) -> float:
    """How far the stated uncertainties let the horizontal rate differ from its known value [rad/s]."""
    slope = math.tan(blank.latitude)
    return blank.expected_rate * math.hypot(stated.scale, slope * stated.latitude, slope * stated.tilt)


def _length(length: float, noise: float, reference: float, confidence: float) -> tuple[float, float]:
    """Interval of the horizontal rate: of the noise, its two sides joined with the stated uncertainties."""
    z = half_width(confidence)
    low, high = (x * noise for x in length_interval(length / noise, confidence))
    below, above = math.hypot(length - low, z * reference), math.hypot(high - length, z * reference)
    return max(length - below, 0.0), length + above


def _mirrored(
    blank: NorthEstimate, solution: NorthSolution, covariance: Array, stated: SetupUncertainty
) -> NorthEstimate:
    """One component p along e is seen: H cos(psi - e) = p, and only the known H tells psi, but for its mirror image."""
    direction = solution.observable[0]
    if (math.atan2(direction[1], direction[0])) % math.tau >= math.pi:
        direction = -direction
    e, p = math.atan2(direction[1], direction[0]), float(direction @ solution.vector)
    sd = math.sqrt(direction @ covariance @ direction)
    half = half_width(blank.confidence) * math.hypot(sd, _reference_sd(blank, stated))
    near, far = ((p + side) / blank.expected_rate for side in (half, -half))
    signal = abs(p) / sd
    if far > 1 or near < -1:
        return replace(blank, interval=(), signal_to_noise=signal)
    inner, outer = (math.acos(min(max(x, -1.0), 1.0)) for x in (near, far))
    if inner <= 0 and outer >= math.pi:
        arcs: tuple[Arc, ...] = (CIRCLE,)
    elif inner <= 0 or outer >= math.pi:
        middle, width = (0.0, outer) if inner <= 0 else (math.pi, math.pi - inner)
        arcs = (Arc.around(e + middle, width, width),)
    else:
        arcs = tuple(Arc(wrapped(a), outer - inner) for a in (e + inner, e - outer))
    angle = math.acos(min(max(p / blank.expected_rate, -1.0), 1.0))
    return replace(
        blank,
        interval=arcs,
        signal_to_noise=signal,
        candidates=tuple(sorted({wrapped(e + angle), wrapped(e - angle)})),
    )


def _running(solution: NorthSolution, rows: NDArray[np.int64], dt: float, inflation: float) -> RunningNorth:
    vector, covariance = solution.running
    length = np.hypot(vector[:, 0], vector[:, 1])
    psi = np.arctan2(vector[:, 1], vector[:, 0])
    across = np.stack([-np.sin(psi), np.cos(psi)], axis=1)
    variance = np.einsum("ni,nij,nj->n", across, covariance, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        sd = inflation * np.sqrt(variance) / length
    return RunningNorth(
        time=rows.astype(np.float64) * dt,
        azimuth=np.mod(psi, math.tau),
        sd=np.where(np.isfinite(sd), sd, np.inf),
        horizontal_rate=length,
    )
