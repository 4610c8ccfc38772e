# SPDX-License-Identifier: BSD-3-Clause
"""The filter that turns parity residuals into independent numbers of variance one.

Parity p = V y of means over windows holds the noise of the sensors and a constant (their biases). Under the noise
models it is the output of a linear system: the states of all sensors, seen through V. The innovations of its Kalman
filter, over their covariance, are independent with variance one [1]; the constant has no prior, so the first window
tells it and has no innovation. The filter is linear: the mark that a fault leaves is filtered in the same way.

References
----------
.. [1] R. K. Mehra, J. Peschon, "An innovations approach to fault detection and diagnosis in dynamic systems",
   Automatica 7 (1971) 637.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, StateSpace, White

__all__ = ["ParityFilter"]

Array = NDArray[np.float64]

#: Relative change of a covariance from which on it is taken to have settled.
SETTLED = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class ParityFilter:
    """What the filter does, window by window, to each of c parts of the parity that do not know of one another.

    Attributes
    ----------
    parity : ndarray, shape (q, n)
        Rows of one part after another.
    index : ndarray of int64, shape (windows,)
        Which step belongs to each window; -1 where a sensor is missing, -2 at the first window.
    steps : ndarray, shape (g + 2, c, s + q/c, s + q/c)
        From the s states of a part (those of its sensors and its constants) and the parity of a window to the states
        before the next one and the innovation.
    roots : ndarray, shape (g, c, q/c, q/c)
        Inverse Cholesky factors of the covariance of the innovations.
    """

    parity: Array
    index: NDArray[np.int64]
    steps: Array
    roots: Array

    @classmethod
    def of(
        cls,
        parity: Array,
        models: Sequence[NoiseModel],
        correlation: Array,
        part: Array,
        *,
        dt: float,
        extra: Array,
    ) -> ParityFilter:
        """The filter of windows of length dt [s].

        Parameters
        ----------
        parity : ndarray, shape (q, n)
            V with V V' = 1.
        models : sequence of NoiseModel
            Of each sensor.
        correlation : ndarray, shape (n, n)
            Of the white noise.
        part : ndarray, shape (windows,)
            Usable part of each window; 0: missing.
        extra : ndarray, shape (windows,) [SI^2]
            Further variance of every sensor, from window to window independent.
        """
        record = max(len(part), 2) * dt
        if all(model.terms == models[0].terms for model in models):
            return _alike(parity, models[0], correlation, dt, record).run(part, extra)
        return _different(parity, models, correlation, dt, record).run(part, extra)

    def whiten(self, means: Array) -> Array:
        """Whitened parity of means of all sensors, shape (windows, n) or (windows, n, c); NaN at missing windows.

        The means may end before the last window.

        Returns
        -------
        ndarray, shape (windows, q) or (windows, q, c)
        """
        y = means[:, :, None] if means.ndim == 2 else means
        p = np.einsum("qn,knc->kqc", self.parity, y)
        begin = int(np.argmax(p.any(axis=(1, 2)))) if p.any() else len(p)
        parts, size = self.roots.shape[1:3]
        index, states, apart = self.index[: len(p)], self.steps.shape[2] - size, (parts, size, p.shape[2])
        innovations = np.zeros((len(p), *apart))
        inside = np.zeros((parts, self.steps.shape[2], p.shape[2]))
        for k, which in enumerate(index[begin:].tolist(), begin):
            inside[:, states:] = p[k].reshape(apart) if which != -1 else 0.0
            inside = self.steps[which] @ inside
            innovations[k] = inside[:, states:]
        out, there = np.full(p.shape, np.nan), index >= 0
        out[there] = (self.roots[index[there]] @ innovations[there]).reshape(-1, *p.shape[1:])
        return out[:, :, 0] if means.ndim == 2 else out

    def direction(self, which: NDArray[np.int64], sensor: int) -> Array:
        """What the whitened parity of a window holds of a sensor, by the number of its root; shape (len(which), q)."""
        column = self.parity[:, sensor].reshape(*self.roots.shape[1:3], 1)
        return np.asarray((self.roots[which] @ column).reshape(len(which), -1))


def _alike(parity: Array, model: NoiseModel, correlation: Array, dt: float, record: float) -> _Recursion:
    """Sensors of one model: along the axes of the covariance of their white noise each parity is one sensor alone."""
    space = model.state_space(dt, sampling="mean", record=record)
    white = _white(model, dt)
    sizes, axes = np.linalg.eigh(parity @ correlation @ parity.T)
    q, size = len(parity), space.size
    return _Recursion(
        parity=axes.T @ parity,
        transition=_padded(space.transition, np.eye(1))[None],
        process=_padded(space.process, np.zeros((1, 1)))[None],
        output=np.append(space.output, 1.0)[None, None],
        shared=white * sizes[:, None, None],
        independent=np.full((q, 1, 1), max(space.noise - white, 0.0)),
        states=size,
        initial=space.initial[None],
    )


def _different(
    parity: Array, models: Sequence[NoiseModel], correlation: Array, dt: float, record: float
) -> _Recursion:
    """Sensors that have a model each: one part, with the states of all."""
    q = len(parity)
    spaces = [m.state_space(dt, sampling="mean", record=record) for m in models]
    system = _joined(spaces)
    white = np.sqrt([_white(m, dt) for m in models])
    rest = np.array([s.noise for s in spaces]) - white**2
    output_matrix = parity @ system.rows
    return _Recursion(
        parity=parity,
        transition=_padded(system.transition, np.eye(q))[None],
        process=_padded(system.process, np.zeros((q, q)))[None],
        output=np.hstack([output_matrix, np.eye(q)])[None],
        shared=(parity @ (np.outer(white, white) * correlation) @ parity.T)[None],
        independent=(parity @ np.diag(np.maximum(rest, 0.0)) @ parity.T)[None],
        states=output_matrix.shape[1],
        initial=system.initial[None],
    )


def _white(model: NoiseModel, dt: float) -> float:
    """Variance of the white noise of a window."""
    return sum(t.N**2 for t in model.terms if isinstance(t, White)) / dt


@dataclass(frozen=True, slots=True, kw_only=True)
class _ParitySystem:
    transition: Array
    process: Array
    initial: Array
    rows: Array  # (n, s): what each sensor shows of the states


def _joined(spaces: Sequence[StateSpace]) -> _ParitySystem:
    """The states of all sensors side by side."""
    size = sum(s.size for s in spaces)
    transition, process, initial = (np.zeros((size, size)) for _ in range(3))
    rows, at = np.zeros((len(spaces), size)), 0
    for i, space in enumerate(spaces):
        block = slice(at, at + space.size)
        transition[block, block], process[block, block], initial[block, block] = (
            space.transition,
            space.process,
            space.initial,
        )
        rows[i, block] = space.output
        at += space.size
    return _ParitySystem(transition=transition, process=process, initial=initial, rows=rows)


def _padded(matrix: Array, corner: Array) -> Array:
    size, q = len(matrix), len(corner)
    out = np.zeros((size + q, size + q))
    out[:size, :size], out[size:, size:] = matrix, corner
    return out


@dataclass(frozen=True, slots=True, kw_only=True)
class _Recursion:
    """The covariance of the states from window to window, from which the gains follow; the first axis are the parts."""

    parity: Array
    transition: Array
    process: Array
    output: Array
    shared: Array
    independent: Array
    states: int
    initial: Array

    def run(self, part: Array, extra: Array) -> ParityFilter:
        index = np.full(len(part), -1, dtype=np.int64)
        gains: list[Array] = []
        roots: list[Array] = []
        covariance: Array | None = None
        settled = False
        for k, fraction in enumerate(part):
            if covariance is None:
                if fraction > 0:
                    index[k] = -2
                    covariance = self._predicted(self._first(self._noise(fraction, extra[k])))
                continue
            plain = fraction == 1.0 and extra[k] == 0.0
            if settled and plain:
                index[k] = len(gains) - 1
                continue
            before, settled = covariance, False
            if fraction > 0:
                gain, root, covariance = self._updated(covariance, self._noise(fraction, extra[k]))
                index[k] = len(gains)
                gains.append(gain)
                roots.append(root)
            covariance = self._predicted(covariance)
            settled = plain and bool(np.abs(covariance - before).max() <= SETTLED * np.abs(covariance).max())
        return ParityFilter(
            parity=self.parity,
            index=index,
            steps=self._steps(gains),
            roots=np.array(roots).reshape(-1, *self.shared.shape),
        )

    def _steps(self, gains: Sequence[Array]) -> Array:
        """One for each gain, and two more: the first window begins the constants, a missing one tells nothing."""
        parts, (q, size) = len(self.shared), self.output.shape[1:]
        steps = np.zeros((len(gains) + 2, parts, size + q, size + q))
        steps[:, :, size:, :size], steps[:, :, size:, size:] = -self.output, np.eye(q)
        steps[-1, :, :size, :size] = self.transition
        steps[-2, :, :size, size:] = self.transition[:, :, self.states :]
        for step, gain in zip(steps, gains, strict=False):
            step[:, :size, :size] = self.transition @ (np.eye(size) - gain @ self.output)
            step[:, :size, size:] = self.transition @ gain
        return steps

    def _noise(self, fraction: float, extra: float) -> Array:
        q = self.shared.shape[1]
        return np.asarray(self.shared / fraction + self.independent + extra * np.eye(q))

    def _first(self, noise: Array) -> Array:
        """Covariance after the first window, which tells the constants: c = p - (seen s + v)."""
        s, size = self.states, self.transition.shape[1]
        output_matrix = self.output[:, :, :s]
        cross = -output_matrix @ self.initial
        out = np.zeros((len(noise), size, size))
        out[:, :s, :s], out[:, s:, :s], out[:, :s, s:] = self.initial, cross, _transposed(cross)
        out[:, s:, s:] = output_matrix @ self.initial @ _transposed(output_matrix) + noise
        return out

    def _updated(self, covariance: Array, noise: Array) -> tuple[Array, Array, Array]:
        cross = covariance @ _transposed(self.output)
        s = self.output @ cross + noise
        root = np.linalg.inv(np.linalg.cholesky(0.5 * (s + _transposed(s))))
        gain = cross @ _transposed(root) @ root
        left = np.eye(covariance.shape[1]) - gain @ self.output
        return gain, root, left @ covariance @ _transposed(left) + gain @ noise @ _transposed(gain)

    def _predicted(self, covariance: Array) -> Array:
        out = self.transition @ covariance @ _transposed(self.transition) + self.process
        return np.asarray(0.5 * (out + _transposed(out)))


def _transposed(matrices: Array) -> Array:
    return matrices.swapaxes(-1, -2)
