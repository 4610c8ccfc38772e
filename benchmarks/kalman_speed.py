# SPDX-License-Identifier: BSD-3-Clause
"""The Kalman filter over a week at 32 Hz, side by side with statsmodels and filterpy.

    python -m benchmarks.kalman_speed

Three states: flicker as one Gauss-Markov state, a rate random walk, and the Earth's rotation, which changes its sign
every 960 samples as the sensor is turned (a time-varying output). Each contender runs in a process of its own, in
interleaved rounds, and the best time of each counts. Ours takes the record in blocks and makes the output of each block
as it goes; memory is the peak of the process, less what it held before the samples were made, less the samples. The
others are measured on a shorter stretch that fits into the cache, which is kind to them, and statsmodels on the whole
record as well. statsmodels (0.14 or newer) and filterpy
are left out where they are not installed.
"""

from __future__ import annotations

import importlib.util
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.noise import Flicker, NoiseModel, RandomWalk, StateSpace, White

from .machine import describe, save

PEERS = ("statsmodels, conventional", "statsmodels, univariate")
WHOLE = "statsmodels, whole record"
N_SAMPLES = 19_353_600
DWELL = 960
BLOCK = 1 << 15
STRETCH = 230_400  # two hours: what the others are measured on
LONG_RUN = 10**8
CHAIN = "one sample of the covariance form is a chain of 31 dependent cycles: 13 ns at 2.4 GHz, however it is written"
ROUNDS = 2
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


class Model:
    """A noise model, and the Earth rate as its last state."""

    def __init__(
        self, transition: Array, process: Array, output: Array, initial: Array, noise: float
    ) -> None:
        n = len(transition) + 1
        self.transition, self.process, self.initial = np.eye(n), np.zeros((n, n)), np.zeros((n, n))
        self.transition[:-1, :-1], self.process[:-1, :-1], self.initial[:-1, :-1] = (
            transition,
            process,
            initial,
        )
        self.initial[-1, -1] = 1e-6
        self.output, self.noise = np.append(output, 0.0), np.full((1, 1, 1), noise)


def seed_model() -> Model:
    phi, variance = np.exp(-DT / T_B), (1.0760 * FLICKER) ** 2
    process = np.diag([variance * (1 - phi**2), WALK**2 * DT])
    return Model(np.diag([phi, 1.0]), process, np.ones(2), np.diag([variance, 0.0]), WHITE**2 / DT)


def default_model() -> Model:
    """What `state_space` makes of white noise, flicker and walk for a week: a sum of Gauss-Markov states."""
    terms = (White(N=WHITE), Flicker(B=FLICKER), RandomWalk(K=WALK))
    space: StateSpace = NoiseModel(terms=terms).state_space(DT, record=N_SAMPLES * DT)
    return Model(space.transition, space.process, space.output, space.initial, space.noise)


# ---- contenders: a record in, what was found out --------------------------------------------------------------------


def ours(model: Model, y: Array, *, square_root: bool) -> Result:
    """Log-likelihood and the last state; seconds in the filter, and with the outputs that had to be made."""
    n, none = len(model.transition), np.empty((0, 1))
    state, covariance, directions = np.zeros(n), model.initial.copy(), np.zeros((n, n))
    sums, counts = np.array([1.0, 0.0, 0.0, 1.0]), np.zeros(6, np.int64)
    if square_root:
        _kernels.kalman_factor(covariance)
    outputs = np.empty((BLOCK, 1, n))
    outputs[:] = model.output
    no_drive, no_readout, nothing = np.empty((0, n)), np.empty((0, n)), np.empty((0, 0))
    in_filter, begin = 0.0, time.perf_counter()
    for start in range(0, len(y), BLOCK):
        block = y[start : start + BLOCK, None]
        outputs[: len(block), 0, -1] = signs(start, start + len(block))
        entry = time.perf_counter()
        _kernels.kalman_filter(
            model.transition, model.process, outputs[: len(block)], model.noise, block, no_drive, no_readout,
            state, covariance, directions, sums, counts, nothing, nothing, none, none, square_root,
        )  # fmt: skip
        in_filter += time.perf_counter() - entry
    total = time.perf_counter() - begin
    if square_root:
        _kernels.kalman_compose(covariance)
    return {
        "seconds": in_filter,
        "seconds_with_outputs": total,
        "log_likelihood": _kernels.kalman_likelihood(sums, counts)[0],
        "state": state[-1],
        "variance": covariance[-1, -1],
    }


def statsmodels(model: Model, y: Array, *, univariate: bool) -> Result:
    """Only the likelihood is kept: its fastest setting."""
    from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

    n = len(model.transition)
    design = np.empty((1, n, len(y)))
    design[0, :-1] = model.output[:-1, None]
    design[0, -1] = signs(0, len(y))
    theirs = KalmanFilter(1, n, nobs=len(y), design=design, transition=model.transition, selection=np.eye(n))
    theirs.bind(y[None, :].copy())
    theirs["obs_cov"], theirs["state_cov"] = model.noise[0], model.process
    theirs.initialize_known(np.zeros(n), model.initial)
    theirs.memory_conserve = theirs.memory_conserve | 0x3FF  # keep nothing that can be spared
    theirs.filter_univariate = univariate
    times = []
    for _ in range(3 if len(y) <= STRETCH else 1):  # the first call also finds its memory
        start = time.perf_counter()
        value = float(theirs.loglike())
        times.append(time.perf_counter() - start)
    return {"seconds": min(times), "log_likelihood": value}


def filterpy(model: Model, y: Array) -> Result:
    from filterpy.kalman import KalmanFilter

    n = len(model.transition)
    theirs = KalmanFilter(dim_x=n, dim_z=1)
    theirs.F, theirs.Q, theirs.R, theirs.P = (
        model.transition,
        model.process,
        model.noise[0],
        model.initial.copy(),
    )
    output, sign = model.output[None, :].copy(), signs(0, len(y))
    start = time.perf_counter()
    for k, value in enumerate(y):
        output[0, -1] = sign[k]
        theirs.update(value, H=output)
        theirs.predict()
    return {"seconds": time.perf_counter() - start, "state": float(theirs.x[-1, 0])}


COVARIANCE, SQUARE_ROOT = "three states, covariance form", "three states, square-root form"
DEFAULT, DEFAULT_ROOT = "default model, covariance form", "default model, square-root form"
CONTENDERS: dict[str, tuple[int, Callable[[Array], Result]]] = {
    COVARIANCE: (N_SAMPLES, lambda y: ours(seed_model(), y, square_root=False)),
    SQUARE_ROOT: (N_SAMPLES, lambda y: ours(seed_model(), y, square_root=True)),
    DEFAULT: (N_SAMPLES, lambda y: ours(default_model(), y, square_root=False)),
    DEFAULT_ROOT: (N_SAMPLES // 10, lambda y: ours(default_model(), y, square_root=True)),
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
    before = _resident_bytes()
    y = samples(n)
    result = contender(y)
    peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {"n_samples": n, "megabytes": (peak - before - y.nbytes) / 1e6, **result}


def measure(name: str) -> Result:
    """One contender, in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.kalman_speed", name]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return dict(json.loads(done.stdout))


def long_run(*, square_root: bool) -> Result:
    """A hundred million steps of a steady filter: is the covariance still one, and the right one?"""
    model = seed_model()
    model.transition[-1, -1], model.process[-1, -1] = (
        0.99,
        1e-12,
    )  # an Earth rate that is never turned is not seen
    model.output[-1] = 1.0
    n, none, nothing = 3, np.empty((0, 1)), np.empty((0, 0))
    state, covariance, directions = np.zeros(n), model.initial.copy(), np.zeros((n, n))
    sums, counts, y = np.array([1.0, 0.0, 0.0, 1.0]), np.zeros(6, np.int64), samples(10**6)[:, None]
    if square_root:
        _kernels.kalman_factor(covariance)
    for _ in range(LONG_RUN // len(y)):
        _kernels.kalman_filter(
            model.transition, model.process, model.output[None, None, :], model.noise, y, np.empty((0, n)),
            np.empty((0, n)), state, covariance, directions, sums, counts, nothing, nothing, none, none, square_root,
        )  # fmt: skip
    if square_root:
        _kernels.kalman_compose(covariance)
    from scipy.linalg import solve_discrete_are

    steady = solve_discrete_are(model.transition.T, model.output[:, None], model.process, model.noise[0])
    eigenvalues = np.linalg.eigvalsh(covariance)
    return {
        "steps": LONG_RUN,
        "symmetric": bool(np.array_equal(covariance, covariance.T)),
        "smallest_eigenvalue_ratio": float(eigenvalues[0] / eigenvalues[-1]),
        "from_steady_state": float(np.max(np.abs(covariance / steady - 1))),
    }


def _resident_bytes() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def nanoseconds(run: Result) -> float:
    return 1e9 * float(run["seconds"]) / int(run["n_samples"])


def check_agreement(best: dict[str, Result]) -> float:
    """Relative differences of log-likelihoods: our two forms, and ours from statsmodels on its stretch."""
    forms = best[COVARIANCE]["log_likelihood"] / best[SQUARE_ROOT]["log_likelihood"] - 1
    others = [
        run for name, run in best.items() if name.startswith("statsmodels, ") and run["n_samples"] == STRETCH
    ]
    short = ours(seed_model(), samples(STRETCH), square_root=False)["log_likelihood"]
    return max([abs(forms), *(abs(run["log_likelihood"] / short - 1) for run in others)])


def notes_of(best: dict[str, Result], long_runs: dict[str, Result], agreement: float) -> list[str]:
    size = len(default_model().transition)
    with_outputs = 1e9 * best[COVARIANCE]["seconds_with_outputs"] / N_SAMPLES
    notes = [
        f"{N_SAMPLES} samples (default model, square-root form: a tenth), log-likelihood included, one thread",
        f"default model: white, flicker, walk and the Earth rate in {size} states",
        f"the time-varying outputs are made block by block; with that the covariance form takes {with_outputs:.1f} ns",
        f"others: {STRETCH} samples and fewer, keeping as little as they can",
        f"largest relative difference of the log-likelihoods: {agreement:.0e}",
    ]
    peers = [nanoseconds(run) for name, run in best.items() if name in PEERS]
    if peers:
        ratios = [min(peers) / nanoseconds(best[name]) for name in (COVARIANCE, SQUARE_ROOT)]
        whole = [nanoseconds(best[WHOLE]) / nanoseconds(best[name]) for name in (COVARIANCE, SQUARE_ROOT)]
        beside = (
            f"statsmodels on the whole record takes {whole[0]:.0f} times the covariance form, {whole[1]:.0f} times the "
            f"square-root form; repeated on a stretch that fits into the cache, {ratios[0]:.0f} and {ratios[1]:.0f}"
        )
        notes += [beside, CHAIN]
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
    best: dict[str, Result] = {}
    for _ in range(ROUNDS):
        for name in names:
            run = measure(name)
            if name not in best or run["seconds"] < best[name]["seconds"]:
                best[name] = run
    agreement = check_agreement(best)
    if agreement > 1e-9:
        raise SystemExit(f"the contenders disagree by {agreement:.1e}: no speed is worth that")
    long_runs = {
        "covariance form": long_run(square_root=False),
        "square-root form": long_run(square_root=True),
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
