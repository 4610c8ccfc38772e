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
    """What the filter does, window by window.

    Attributes
    ----------
    parity : ndarray, shape (q, n)
    index : ndarray of int64, shape (windows,)
        Which step belongs to each window; -1 where a sensor is missing, -2 at the first window.
    steps : ndarray, shape (g + 2, s + q, s + q)
        From the s states (those of all sensors and the q constants) and the parity of a window to the states before
        the next one and the innovation.
    roots : ndarray, shape (g, q, q)
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
        models : sequence of NoiseModel
            Of each sensor.
        correlation : ndarray, shape (n, n)
            Of the white noise.
        part : ndarray, shape (windows,)
            Usable part of each window; 0: missing.
        extra : ndarray, shape (windows,) [SI^2]
            Further variance of every sensor, from window to window independent.
        """
        q = len(parity)
        spaces = [m.state_space(dt, sampling="mean", record=max(len(part), 2) * dt) for m in models]
        system = _joined(spaces)
        white = np.sqrt([sum(t.N**2 for t in m.terms if isinstance(t, White)) / dt for m in models])
        rest = np.array([s.noise for s in spaces]) - white**2
        shared = parity @ (np.outer(white, white) * correlation) @ parity.T
        independent_noise = parity @ np.diag(np.maximum(rest, 0.0)) @ parity.T
        output_matrix = parity @ system.rows
        steps = _Recursion(
            transition=_padded(system.transition, q, np.eye(q)),
            process=_padded(system.process, q, np.zeros((q, q))),
            output=np.hstack([output_matrix, np.eye(q)]),
            shared=shared,
            independent=independent_noise,
            states=output_matrix.shape[1],
            initial=system.initial,
        )
        return steps.run(parity, part, extra)

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
        index, states = self.index[: len(p)], self.steps.shape[1] - p.shape[1]
        innovations = np.zeros(p.shape)
        inside = np.zeros((self.steps.shape[1], p.shape[2]))
        for k, which in enumerate(index[begin:].tolist(), begin):
            inside[states:] = p[k] if which != -1 else 0.0
            inside = self.steps[which] @ inside
            innovations[k] = inside[states:]
        out, there = np.full(p.shape, np.nan), index >= 0
        out[there] = self.roots[index[there]] @ innovations[there]
        return out[:, :, 0] if means.ndim == 2 else out


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


def _padded(matrix: Array, q: int, corner: Array) -> Array:
    size = len(matrix)
    out = np.zeros((size + q, size + q))
    out[:size, :size], out[size:, size:] = matrix, corner
    return out


@dataclass(frozen=True, slots=True, kw_only=True)
class _Recursion:
    """The covariance of the states from window to window, from which the gains follow."""

    transition: Array
    process: Array
    output: Array
    shared: Array
    independent: Array
    states: int
    initial: Array

    def run(self, parity: Array, part: Array, extra: Array) -> ParityFilter:
        q = len(parity)
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
            parity=parity, index=index, steps=self._steps(gains), roots=np.array(roots).reshape(-1, q, q)
        )

    def _steps(self, gains: Sequence[Array]) -> Array:
        """One for each gain, and two more: the first window begins the constants, a missing one tells nothing."""
        q, size = self.output.shape
        first = np.zeros((size, q))
        first[self.states :] = np.eye(q)
        kept = np.array([*([np.eye(size)] * len(gains)), np.zeros((size, size)), np.eye(size)])
        along = np.array([*gains, first, np.zeros((size, q))])
        kept[: len(gains)] -= along[: len(gains)] @ self.output
        steps = np.zeros((len(kept), size + q, size + q))
        steps[:, :size, :size], steps[:, :size, size:] = self.transition @ kept, self.transition @ along
        steps[:, size:, :size], steps[:, size:, size:] = -self.output, np.eye(q)
        return steps

    def _noise(self, fraction: float, extra: float) -> Array:
        return np.asarray(self.shared / fraction + self.independent + extra * np.eye(len(self.independent)))

    def _first(self, noise: Array) -> Array:
        """Covariance after the first window, which tells the constants: c = p - (seen s + v)."""
        size, s = len(self.transition), self.states
        output_matrix = self.output[:, :s]
        cross = -output_matrix @ self.initial
        out = np.zeros((size, size))
        out[:s, :s], out[s:, :s], out[:s, s:] = self.initial, cross, cross.T
        out[s:, s:] = output_matrix @ self.initial @ output_matrix.T + noise
        return out

    def _updated(self, covariance: Array, noise: Array) -> tuple[Array, Array, Array]:
        cross = covariance @ self.output.T
        s = self.output @ cross + noise
        root = np.linalg.inv(np.linalg.cholesky(0.5 * (s + s.T)))
        gain = cross @ root.T @ root
        left = np.eye(len(covariance)) - gain @ self.output
        return gain, root, left @ covariance @ left.T + gain @ noise @ gain.T

    def _predicted(self, covariance: Array) -> Array:
        out = self.transition @ covariance @ self.transition.T + self.process
        return np.asarray(0.5 * (out + out.T))
