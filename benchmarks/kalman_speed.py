# SPDX-License-Identifier: BSD-3-Clause
"""The Kalman filter over a week at 32 Hz, side by side with statsmodels and filterpy.

    python -m benchmarks.kalman_speed

Three states: flicker as one Gauss-Markov state, a rate random walk, and the Earth's rotation, which changes its sign
every 960 samples as the sensor is turned (a time-varying output). Each contender runs in a process of its own, in
interleaved rounds, and the best time of each counts. Ours is `log_likelihood`, which filters a long record in strands
side by side, with one thread and with two; and beside it the filter that goes row by row and tells each innovation.
The outputs are views of a short table: they repeat. Memory is the peak of the process, less what it held before the
samples were made, less the samples. The others are measured on a shorter stretch that fits into the cache, which is
kind to them, and statsmodels on the whole record as well. statsmodels (0.14 or newer) and filterpy are left out where
they are not installed.
"""

from __future__ import annotations

import importlib.util
import json
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.filtering.kalman import Form, log_likelihood
from allanite.noise import Flicker, NoiseModel, RandomWalk, StateSpace, White

from .machine import describe, save
from .processes import best_runs, peak_bytes, resident_bytes

PEERS = ("statsmodels, conventional", "statsmodels, univariate")
WHOLE = "statsmodels, whole record"
N_SAMPLES = 19_353_600
DWELL = 960
BLOCK = 1 << 15
LONGEST_BLOCK = 1 << 18
STRETCH = 230_400  # two hours: what the others are measured on
LONG_RUN = 10**8
CHAIN = "row by row, one sample of the covariance form is a chain of 31 dependent cycles: 13 ns at 2.4 GHz"
ROUNDS = 4
DT = 1 / 32
EARTH = 7.292115e-5 * np.cos(np.radians(23.31))
# The sensor of the seed paper in SI: N [rad/sqrt(s)], B [rad/s], K [rad/s^(3/2)], T_b [s]
WHITE, FLICKER, WALK, T_B = 2.129e-4, 4.712e-5, 1.192e-6, 238.1
Array = NDArray[np.float64]
Result = dict[str, Any]


def samples(n: int) -> Array:
    """White noise on the Earth rate of a sensor that is turned: the filter's time depends on neither."""
    y = np.random.Generator(np.random.SFC64(7)).standard_normal(n)
    y *= WHITE / np.sqrt(DT)
    for start in range(0, n, 2 * DWELL):
        y[start : start + DWELL] += EARTH
        y[start + DWELL : start + 2 * DWELL] -= EARTH
    return y


def signs(start: int, stop: int) -> Array:
    return 1.0 - 2.0 * (np.arange(start, stop) // DWELL % 2)


def outputs_of(space: StateSpace, most_rows: int) -> Callable[[int, int], Array]:
    """The rows of h from one to another, so many at most."""
    table = np.tile(space.output, (2 * DWELL + most_rows, 1))
    table[:, -1] = signs(0, len(table))

    def outputs(start: int, stop: int) -> Array:
        first = start % (2 * DWELL)
        return table[first : first + stop - start]

    return outputs


def with_earth(space: StateSpace) -> StateSpace:
    """The Earth rate as the last state: constant, of unknown size."""
    with_constant = space.with_constant(label="Earth rate")
    initial = with_constant.initial.copy()
    initial[-1, -1] = 1e-6
    return replace(with_constant, initial=initial, diffuse=np.zeros(with_constant.size, dtype=bool))


def seed_model() -> StateSpace:
    phi, variance = np.exp(-DT / T_B), (1.0760 * FLICKER) ** 2
    flicker_and_walk = StateSpace(
        transition=np.diag([phi, 1.0]),
        process=np.diag([variance * (1 - phi**2), WALK**2 * DT]),
        output=np.ones(2),
        noise=WHITE**2 / DT,
        initial=np.diag([variance, 0.0]),
        rate=np.ones(2),
        labels=("flicker", "walk"),
        diffuse=np.zeros(2, dtype=bool),
    )
    return with_earth(flicker_and_walk)


def default_model() -> StateSpace:
    """What `state_space` makes of white noise, flicker and walk for a week: a sum of Gauss-Markov states."""
    terms = (White(N=WHITE), Flicker(B=FLICKER), RandomWalk(K=WALK))
    return with_earth(NoiseModel(terms=terms).state_space(DT, record=N_SAMPLES * DT))


# ---- contenders: a record in, what was found out --------------------------------------------------------------------


def ours(space: StateSpace, y: Array, *, form: Form, threads: int = 1) -> Result:
    """Log-likelihood, in strands."""
    outputs, times, value = outputs_of(space, min(LONGEST_BLOCK, len(y))), [], 0.0
    for _ in range(3):
        start = time.perf_counter()
        value = log_likelihood(y, space, outputs=outputs, form=form, threads=threads)
        times.append(time.perf_counter() - start)
    return {"seconds": min(times), "log_likelihood": value}


def row_by_row(space: StateSpace, y: Array, *, square_root: bool) -> Result:
    """Log-likelihood, the innovations of each block, and the last state."""
    n, none = space.size, np.empty((0, 1))
    state, covariance, directions = np.zeros(n), space.initial.copy(), np.zeros((n, n))
    sums, counts = np.array([1.0, 0.0, 0.0, 1.0]), np.zeros(6, np.int64)
    if square_root:
        _kernels.kalman_factor(covariance)
    outputs, noise = outputs_of(space, min(BLOCK, len(y))), np.full((1, 1, 1), space.noise)
    innovations, variances = np.empty((BLOCK, 1)), np.empty((BLOCK, 1))
    no_drive, no_readout = np.empty((0, n)), np.empty((0, n))
    begin = time.perf_counter()
    for start in range(0, len(y), BLOCK):
        block = y[start : start + BLOCK, None]
        rows = len(block)
        _kernels.kalman_filter(
            space.transition, space.process, outputs(start, start + rows)[:, None], noise, block, no_drive, no_readout,
            state, covariance, directions, sums, counts, none[:, :0], none[:, :0], innovations[:rows], variances[:rows],
            square_root,
        )  # fmt: skip
    seconds = time.perf_counter() - begin
    if square_root:
        _kernels.kalman_compose(covariance)
    return {
        "seconds": seconds,
        "log_likelihood": _kernels.kalman_likelihood(sums, counts)[0],
        "state": state[-1],
        "variance": covariance[-1, -1],
    }


def statsmodels(model: StateSpace, y: Array, *, univariate: bool) -> Result:
    """Only the likelihood is kept: its fastest setting."""
    from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

    n = len(model.transition)
    design = np.empty((1, n, len(y)))
    design[0, :-1] = model.output[:-1, None]
    design[0, -1] = signs(0, len(y))
    theirs = KalmanFilter(1, n, nobs=len(y), design=design, transition=model.transition, selection=np.eye(n))
    theirs.bind(y[None, :].copy())
    theirs["obs_cov"], theirs["state_cov"] = [[model.noise]], model.process
    theirs.initialize_known(np.zeros(n), model.initial)
    theirs.memory_conserve = theirs.memory_conserve | 0x3FF  # keep nothing that can be spared
    theirs.filter_univariate = univariate
    times = []
    for _ in range(3 if len(y) <= STRETCH else 1):  # the first call also finds its memory
        start = time.perf_counter()
        value = float(theirs.loglike())
        times.append(time.perf_counter() - start)
    return {"seconds": min(times), "log_likelihood": value}


def filterpy(model: StateSpace, y: Array) -> Result:
    from filterpy.kalman import KalmanFilter

    n = len(model.transition)
    theirs = KalmanFilter(dim_x=n, dim_z=1)
    theirs.F, theirs.Q, theirs.R, theirs.P = (
        model.transition,
        model.process,
        np.array([[model.noise]]),
        model.initial.copy(),
    )
    output, sign = model.output[None, :].copy(), signs(0, len(y))
    start = time.perf_counter()
    for k, value in enumerate(y):
        output[0, -1] = sign[k]
        theirs.update(value, H=output)
        theirs.predict()
    return {"seconds": time.perf_counter() - start, "state": float(theirs.x[-1, 0])}


FORMS: tuple[Form, ...] = ("covariance", "square root")
THREADS = {1: "one thread", 2: "two threads"}


def name_of(form: Form, threads: int) -> str:
    return f"three states, {form} form, {THREADS[threads]}"


def strands_of(form: Form, threads: int) -> tuple[int, Callable[[Array], Result]]:
    return N_SAMPLES, lambda y: ours(seed_model(), y, form=form, threads=threads)


ROW_BY_ROW = {form: f"three states, {form} form, row by row" for form in FORMS}
DEFAULT, DEFAULT_ROOT = (
    "default model, covariance form, row by row",
    "default model, square root form, row by row",
)
CONTENDERS: dict[str, tuple[int, Callable[[Array], Result]]] = {
    **{name_of(form, threads): strands_of(form, threads) for form in FORMS for threads in THREADS},
    ROW_BY_ROW["covariance"]: (N_SAMPLES, lambda y: row_by_row(seed_model(), y, square_root=False)),
    ROW_BY_ROW["square root"]: (N_SAMPLES, lambda y: row_by_row(seed_model(), y, square_root=True)),
    DEFAULT: (N_SAMPLES, lambda y: row_by_row(default_model(), y, square_root=False)),
    DEFAULT_ROOT: (N_SAMPLES // 10, lambda y: row_by_row(default_model(), y, square_root=True)),
    "statsmodels, conventional": (STRETCH, lambda y: statsmodels(seed_model(), y, univariate=False)),
    "statsmodels, univariate": (STRETCH, lambda y: statsmodels(seed_model(), y, univariate=True)),
    WHOLE: (N_SAMPLES, lambda y: statsmodels(seed_model(), y, univariate=False)),
    "statsmodels, default model": (STRETCH // 10, lambda y: statsmodels(default_model(), y, univariate=True)),
    "filterpy": (STRETCH // 10, lambda y: filterpy(seed_model(), y)),
}


# ---- measuring ------------------------------------------------------------------------------------------------------


def measure_here(name: str) -> Result:
    n, contender = CONTENDERS[name]
    contender(samples(5000))  # imports and first call are not timed
    before = resident_bytes()
    y = samples(n)
    result = contender(y)
    return {"n_samples": n, "megabytes": (peak_bytes() - before - y.nbytes) / 1e6, **result}


def long_run(*, square_root: bool) -> Result:
    """A hundred million steps of a steady filter: is the covariance still one, and the right one?"""
    model = seed_model()
    transition, process = model.transition.copy(), model.process.copy()
    transition[-1, -1], process[-1, -1] = 0.99, 1e-12  # an Earth rate that is never turned is not seen
    output, noise = np.ones((1, 1, 3)), np.full((1, 1, 1), model.noise)
    n, none, nothing = 3, np.empty((0, 1)), np.empty((0, 0))
    state, covariance, directions = np.zeros(n), model.initial.copy(), np.zeros((n, n))
    sums, counts, y = np.array([1.0, 0.0, 0.0, 1.0]), np.zeros(6, np.int64), samples(10**6)[:, None]
    if square_root:
        _kernels.kalman_factor(covariance)
    for _ in range(LONG_RUN // len(y)):
        _kernels.kalman_filter(
            transition, process, output, noise, y, np.empty((0, n)), np.empty((0, n)), state, covariance, directions,
            sums, counts, nothing, nothing, none, none, square_root,
        )  # fmt: skip
    if square_root:
        _kernels.kalman_compose(covariance)
    from scipy.linalg import solve_discrete_are

    steady = solve_discrete_are(transition.T, output[0].T, process, noise[0])
    eigenvalues = np.linalg.eigvalsh(covariance)
    return {
        "steps": LONG_RUN,
        "symmetric": bool(np.array_equal(covariance, covariance.T)),
        "smallest_eigenvalue_ratio": float(eigenvalues[0] / eigenvalues[-1]),
        "from_steady_state": float(np.max(np.abs(covariance / steady - 1))),
    }


def nanoseconds(run: Result) -> float:
    return 1e9 * float(run["seconds"]) / int(run["n_samples"])


def check_agreement(best: dict[str, Result]) -> float:
    """Relative differences of log-likelihoods: strands from row by row, form from form, ours from statsmodels."""
    one = best[ROW_BY_ROW["covariance"]]["log_likelihood"]
    whole = [run for name, run in best.items() if name.startswith("three states") or name == WHOLE]
    short = row_by_row(seed_model(), samples(STRETCH), square_root=False)["log_likelihood"]
    stretch = [best[name] for name in PEERS if name in best]
    return max(
        [abs(run["log_likelihood"] / one - 1) for run in whole]
        + [abs(run["log_likelihood"] / short - 1) for run in stretch]
    )


def ratios(best: dict[str, Result], theirs: float, threads: int) -> str:
    return " and ".join(f"{theirs / nanoseconds(best[name_of(form, threads)]):.0f}" for form in FORMS)


def notes_of(best: dict[str, Result], long_runs: dict[str, Result], agreement: float) -> list[str]:
    size = default_model().size
    notes = [
        f"{N_SAMPLES} samples (default model, square root form: a tenth), log-likelihood included",
        "row by row each innovation and its variance are kept too, block by block",
        f"default model: white, flicker, walk and the Earth rate in {size} states",
        f"others: {STRETCH} samples and fewer, keeping as little as they can",
        f"largest relative difference of the log-likelihoods: {agreement:.0e}",
    ]
    peers = [nanoseconds(run) for name, run in best.items() if name in PEERS]
    for threads, words in THREADS.items() if peers else ():
        notes.append(
            f"{words}, covariance and square root form: {ratios(best, min(peers), threads)} times as fast as "
            f"statsmodels repeated on a stretch that fits into the cache, "
            f"{ratios(best, nanoseconds(best[WHOLE]), threads)} times as fast as statsmodels on the whole record"
        )
    notes.append(CHAIN)
    for form, run in long_runs.items():
        notes.append(
            f"{run['steps']:.0e} steps, {form}: covariance symmetric: {'yes' if run['symmetric'] else 'NO'}, smallest "
            f"eigenvalue {run['smallest_eigenvalue_ratio']:.1e} of the largest, "
            f"{run['from_steady_state']:.0e} from the steady state"
        )
    return notes


def main() -> None:
    packages = [name for name in ("statsmodels", "filterpy") if importlib.util.find_spec(name)]
    names = [name for name in CONTENDERS if not name.startswith(("statsmodels", "filterpy"))]
    names += [name for name in CONTENDERS if name.startswith(tuple(packages or ["-"]))]
    best = best_runs("kalman_speed", names, ROUNDS, "seconds")
    agreement = check_agreement(best)
    if agreement > 1e-9:
        raise SystemExit(f"the contenders disagree by {agreement:.1e}: no speed is worth that")
    long_runs = {
        "covariance form": long_run(square_root=False),
        "square root form": long_run(square_root=True),
    }
    result: Result = {
        "machine": describe(*packages),
        "contenders": {
            name: {"nanoseconds_per_sample": nanoseconds(run), **run} for name, run in best.items()
        },
        "long_runs": long_runs,
        "log_likelihood_difference": agreement,
        "notes": notes_of(best, long_runs, agreement),
    }
    rows = [
        [name, str(run["n_samples"]), f"{nanoseconds(run):.1f}", f"{run['megabytes']:.0f}"]
        for name, run in best.items()
    ]
    header = ["filter", "samples", "ns per sample", "MB beyond the samples"]
    print(save("kalman_speed", "Kalman filter, a week at 32 Hz", result, header, rows))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(measure_here(sys.argv[1])))
    else:
        main()
