# SPDX-License-Identifier: BSD-3-Clause
"""Records that are too long to be simulated two thousand times, as the likelihood sees them.

All that the likelihood keeps of what happens within 32 samples are the second moments of some hundred thousand blocks.
So the means over one block are simulated, exactly, and that matrix is drawn from its Wishart law:
`verification.likelihood.run_chain` compares this short chain with the whole one on full records.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.fitting.likelihood import LikelihoodProblem
from allanite.fitting.likelihood.bands import bands
from allanite.fitting.likelihood.objective import Objective, RandomTerm
from allanite.fitting.likelihood.pool import Pool
from allanite.fitting.likelihood.pyramid import BLOCK, TOP, LikelihoodPyramid, build
from allanite.noise import GaussMarkov, NoiseModel, TermType
from allanite.recording.records import Recording
from verification.scenarios import Scenario

__all__ = ["chained", "coefficient", "component", "short_chain"]

Array = NDArray[np.float64]


def short_chain(scenario: Scenario, seed: int) -> LikelihoodProblem:
    """The problem of one record of a scenario."""
    means = al.simulate(scenario.model, rate=scenario.rate / BLOCK, duration=scenario.duration, seed=seed)
    return chained(scenario.model, means, seed)


def chained(model: NoiseModel, means: Recording, seed: int) -> LikelihoodProblem:
    """The problem of a record of a model whose means over one block are these."""
    y, dt = means.values(means.names[0]), means.dt / BLOCK
    upper = build([y], len(y), BLOCK)
    quick = _drawn(model, dt, len(y) - 2, np.random.default_rng([seed, 32]))
    pyramid = replace(upper, pools=(quick, *upper.pools), present=len(y) * BLOCK)
    objective = Objective.of(pyramid, "mean")
    return LikelihoodProblem(
        channel=means[means.names[0]],
        dt=dt,
        n_samples=len(y) * BLOCK,
        block=1,
        engine="composite",
        objective=objective,
        octaves=tuple(bands(objective)),
        lines=(),
        recording=means,
    )


def _drawn(model: NoiseModel, dt: float, count: int, rng: np.random.Generator) -> Pool:
    """Second moments of the inside of so many blocks: Wishart, by Bartlett's decomposition."""
    shape = build([np.zeros(BLOCK * TOP)], BLOCK * TOP).pools[0]
    one = Objective(LikelihoodPyramid(pools=(shape,), modes=None, present=0, log_volume=0.0), "mean", 1.0)
    V = np.asarray(sum(coefficient(t, dt) * one.matrices(component(t, dt))[0][0] for t in model.terms))
    A = np.tril(rng.standard_normal(V.shape), -1)
    np.fill_diagonal(A, np.sqrt(rng.chisquare(count - np.arange(len(V)))))
    root = np.linalg.cholesky(V) @ A
    return replace(shape, count=count, mean=np.zeros(len(V)), second=root @ root.T / count)


def component(term: TermType, dt: float) -> RandomTerm:
    """A term as the likelihood knows it."""
    return RandomTerm("G", term.T / dt) if isinstance(term, GaussMarkov) else RandomTerm(term.symbols[0])


def coefficient(term: TermType, dt: float) -> float:
    """Its variance coefficient in sample units."""
    if isinstance(term, GaussMarkov):
        return term.sigma**2
    symbol = term.symbols[0]
    return float(getattr(term, symbol)) ** 2 * dt ** {"Q": -2, "N": -1, "B": 0, "K": 1}[symbol]
