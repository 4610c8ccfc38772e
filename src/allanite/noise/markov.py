# SPDX-License-Identifier: BSD-3-Clause
"""Noise as first-order Markov states on the sample grid: one exact form, for making records and for filtering them.

Nothing is approximated by a small step: the states are advanced by their exact transition, and where a sample is the
mean over its interval the mean is drawn from its exact distribution given the states at both ends.

Notes
-----
Let s be a Gauss-Markov state with variance sigma^2 and correlation time T, and a = Ts/T. Between two instants it is
a bridge, and its mean over the interval, given both ends, is

    w (s_k + s_{k+1}) + independent noise,    w = tanh(a/2)/a,
    variance of that noise = (2 sigma^2/a^2) (a - 2 tanh(a/2))                                            (1)

(the mean from E[s(t) | ends] = [sinh((Ts - t)/T) s_k + sinh(t/T) s_{k+1}]/sinh(a); the variance is that of the mean,
(2 sigma^2/a^2)(a - 1 + e^-a), less w^2 times that of s_k + s_{k+1}). For a random walk the limit is w = 1/2 and
K^2 Ts/12. Intervals are independent given the states, so all this noise merges with the white noise of the sample:
one normal number for each sample and one for each state.

A filter needs y_k as a function of one state vector. The mean over the interval joins the states for that: one more
state z_k = sum over j of now_j s_j(k) + later_j s_j(k+1), whatever the number of terms.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from allanite.lazy_dataclasses import dataclass
from allanite.noise.state_space import StateSpace, stateless

__all__ = ["MarkovForm", "MarkovState", "gauss_markov_form", "random_walk_form"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkovState:
    """s_{k+1} = phi s_k + step w_k, s_0 with deviation `start`; sample k holds now s_k + later s_{k+1}.

    `rate` is what the state adds to the signal at an instant; 0 where it stands for something faster than a sample.
    `label` is the type of its term.
    """

    phi: float
    step: float
    start: float
    now: float
    later: float
    label: str
    rate: float = 1.0

    def scaled(self, factor: float) -> MarkovState:
        return replace(self, now=self.now * factor, later=self.later * factor, rate=self.rate * factor)


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkovForm:
    """A sum of independent Markov states and of white noise, `white` being its variance in one sample."""

    states: tuple[MarkovState, ...] = ()
    white: float = 0.0

    def __add__(self, other: MarkovForm) -> MarkovForm:
        return MarkovForm(states=self.states + other.states, white=self.white + other.white)

    def scaled(self, factor: float) -> MarkovForm:
        return MarkovForm(states=tuple(s.scaled(factor) for s in self.states), white=self.white * factor**2)

    def state_space(self) -> StateSpace:
        """What a filter needs; where samples are means, the mean over the interval is its last state."""
        if not self.states:
            return stateless(self.white)
        phi, step, start, now, later, rate = np.array(
            [[s.phi, s.step, s.start, s.now, s.later, s.rate] for s in self.states]
        ).T
        labels = tuple(s.label for s in self.states)
        if not later.any():
            return StateSpace(
                transition=np.diag(phi),
                process=np.diag(step**2),
                output=now,
                noise=self.white,
                initial=np.diag(start**2),
                rate=rate,
                labels=labels,
                diffuse=np.zeros(len(phi), dtype=np.bool_),
            )
        n = len(phi)
        transition = np.zeros((n + 1, n + 1))
        transition[:n, :n] = np.diag(phi)
        transition[n, :n] = now + later * phi
        driving = np.vstack([np.diag(step), later * step])
        before = np.append(start**2, 0.0)
        return StateSpace(
            transition=transition,
            process=driving @ driving.T,
            output=np.append(np.zeros(n), 1.0),
            noise=self.white,
            initial=transition @ np.diag(before) @ transition.T + driving @ driving.T,
            rate=np.append(rate, 0.0),
            labels=(*labels, "mean"),
            diffuse=np.zeros(n + 1, dtype=np.bool_),
        )


def random_walk_form(K: float, dt: float, sampling: str, label: str) -> MarkovForm:
    """A walk that starts at zero at the beginning of the first sample."""
    step = K * math.sqrt(dt)
    if sampling == "point":
        return MarkovForm(
            states=(MarkovState(phi=1.0, step=step, start=0.0, now=1.0, later=0.0, label=label),)
        )
    state = MarkovState(phi=1.0, step=step, start=0.0, now=0.5, later=0.5, label=label)
    return MarkovForm(states=(state,), white=K**2 * dt / 12)


def gauss_markov_form(sigma: float, T: float, dt: float, sampling: str, label: str) -> MarkovForm:
    """A stationary Gauss-Markov state."""
    a = dt / T
    phi, step = math.exp(-a), sigma * math.sqrt(-math.expm1(-2 * a))
    if sampling == "point":
        return MarkovForm(
            states=(MarkovState(phi=phi, step=step, start=sigma, now=1.0, later=0.0, label=label),)
        )
    weight, rest = _bridge(a)
    state = MarkovState(phi=phi, step=step, start=sigma, now=weight, later=weight, label=label)
    return MarkovForm(states=(state,), white=sigma**2 * rest)


def _bridge(a: float) -> tuple[float, float]:
    """Weight of the end points, and variance of the rest over sigma^2, of the mean of a Gauss-Markov state: eq. (1).

    tanh x = x/(1 + d) with the continued fraction d = x^2/(3 + x^2/(5 + ...)), so that x - tanh x = x d/(1 + d) keeps
    every digit however small x is.
    """
    x = a / 2
    if x > 1:
        return math.tanh(x) / a, (1 - math.tanh(x) / x) / x
    d = 0.0
    for odd in (17, 15, 13, 11, 9, 7, 5, 3):
        d = x * x / (odd + d)
    return 0.5 / (1 + d), 0.0 if x == 0 else d / (1 + d) / x
