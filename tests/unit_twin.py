# SPDX-License-Identifier: BSD-3-Clause
"""A light twin of a unit that is put from position to position: what its triads see, to the last digit, and noise."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.noise import NoiseModel
from allanite.noise.markov import MarkovForm
from allanite.quantities.attitude import rotation, rotation_vector
from allanite.quantities.earth import earth_rate_vector
from allanite.recording.calibration import TriadErrors
from allanite.recording.records import Channel, Recording
from allanite.recording.sample_columns import ArrayColumn

__all__ = ["Path", "attitude_up", "noise"]

Array = NDArray[np.float64]
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def attitude_up(up: ArrayLike, heading: float = 0.0) -> Array:
    """Body to north, east, down with this direction of the body up."""
    v = -np.asarray(up, dtype=np.float64) / np.linalg.norm(up)
    axis = np.cross(v, [0.0, 0.0, 1.0])
    s = float(np.linalg.norm(axis))
    if s < 1e-12:
        c = np.eye(3) if v[2] > 0 else np.diag([1.0, -1.0, -1.0])
    else:
        c = rotation(axis / s * np.arctan2(s, v[2]))
    return np.asarray(rotation([0.0, 0.0, heading]) @ c)


class Path:
    """Rest, turn, rest, ...: each turn about one axis at one rate as the Earth sees it; means over samples."""

    def __init__(
        self,
        attitudes: list[Array],
        *,
        rate: float = 50.0,
        dwell: float = 4.0,
        turn: float = 2.0,
        latitude: float | None = None,
        gravity: float = 9.81,
    ) -> None:
        self.rate, self.gravity = rate, gravity
        earth = np.zeros(3) if latitude is None else earth_rate_vector(latitude)
        force = np.array([0.0, 0.0, -gravity])
        rest, move = round(dwell * rate), round(turn * rate)
        w, f, spans, at = [], [], [], 0
        for i, c in enumerate(attitudes):
            w.append(np.tile(c.T @ earth, (rest, 1)))
            f.append(np.tile(c.T @ force, (rest, 1)))
            spans.append((at, at + rest))
            at += rest
            if i + 1 < len(attitudes):
                vector = rotation_vector(c.T @ attitudes[i + 1])
                part = (np.arange(move)[:, None] + (_NODES + 1) / 2) / move
                back = np.swapaxes(c @ rotation(vector * part[..., None]), -1, -2)
                w.append(np.einsum("nqij,j,q->ni", back, earth, _WEIGHTS / 2) + vector * rate / move)
                f.append(np.einsum("nqij,j,q->ni", back, force, _WEIGHTS / 2))
                at += move
        self.rates, self.forces = np.concatenate(w), np.concatenate(f)
        self.spans, self.count = np.array(spans), at

    def recording(
        self,
        accelerometer: TriadErrors | None,
        gyro: TriadErrors | None,
        models: Mapping[str, NoiseModel] | None = None,
        *,
        seed: int = 0,
        units: tuple[str, str] = ("m/s²", "rad/s"),
        gains: tuple[float, float] = (1.0, 1.0),
        offset: float = 0.0,
        warmth: Array | None = None,
    ) -> Recording:
        """Samples times `gains` plus `offset`, in `units`."""
        rng = np.random.default_rng(seed)
        warmer = np.zeros(self.count) if warmth is None else warmth
        columns, channels = [], []
        for k, (kind, errors, true) in enumerate(
            (("accel", accelerometer, self.forces), ("gyro", gyro, self.rates))
        ):
            if errors is None:
                continue
            y = errors.seen(true, warmer, self.forces)
            for axis, letter in enumerate("xyz"):
                name = f"{kind}_{letter}"
                own = 0.0 if models is None else noise(models[name], self.count, 1 / self.rate, rng)
                columns.append(ArrayColumn((y[:, axis] + own) * gains[k] + offset))
                channels.append(Channel.of(name, units[k]))
        if warmth is not None:
            columns.append(ArrayColumn(warmth))
            channels.append(Channel.of("temperature", "degC"))
        return Recording(channels=tuple(channels), columns=tuple(columns), rate=self.rate)


def noise(model: NoiseModel, n: int, dt: float, rng: np.random.Generator) -> Array:
    """Samples of a noise model as interval means, from its Markov states."""
    from scipy.signal import lfilter

    form = MarkovForm()
    for term in model.terms:
        form = form + term.markov(dt, sampling="mean", record=n * dt, ratio=np.sqrt(10))
    out = rng.standard_normal(n) * np.sqrt(form.white)
    for state in form.states:
        steps = rng.standard_normal(n + 1) * state.step
        steps[0] *= 0.0 if state.step == 0 else state.start / state.step
        path = lfilter([1.0], [1.0, -state.phi], steps)
        out += state.now * path[:-1] + state.later * path[1:]
    return np.asarray(out)
