# SPDX-License-Identifier: BSD-3-Clause
"""`filter_recording` over a week at 32 Hz: corrected samples, drift and its standard deviation at each sample.

    python -m benchmarks.filter_speed

Processor time, the reading of the samples, the tests of the innovations and the files of the three series included. In
interleaved rounds, of which the best counts; memory is the peak of a process that does nothing else, less what it held
before. The filter row by row is the same without polynomials of the gain. filterpy keeps state and variance of each
sample of a shorter stretch, statsmodels too; both are left out where they are not installed.
"""

from __future__ import annotations

import importlib.util
import json
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.filtering.kalman import filter_recording, filtering
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.recording.records import Recording

from .machine import describe, save
from .processes import best_runs, peak_bytes, resident_bytes

N_SAMPLES, STRETCH, ROUNDS, RATE = 19_353_600, 23_040, 4, 32.0
WHITE, WALK, FLICKER = White(N=2.129e-4), RandomWalk(K=1.192e-6), Flicker(B=4.712e-5)
MODELS = {
    "white + walk": NoiseModel.of(WHITE, WALK),
    "white + flicker + walk": NoiseModel.of(WHITE, FLICKER, WALK),
}
Array = NDArray[np.float64]


def samples(n: int, gap_every: int = 0) -> Array:
    y = np.random.Generator(np.random.SFC64(7)).standard_normal(n) * (WHITE.N * np.sqrt(RATE)) + 1e-4
    if gap_every:
        y[gap_every::gap_every] = np.nan
    return y


def ours(model: NoiseModel, y: Array, *, segments: bool = True) -> None:
    source = Recording.from_rate(y, rate=RATE, unit="rad/s", names="gyro")
    if not segments:
        filtering.SEGMENTS_FROM = len(y) + 1
    filter_recording(source, model)


def statsmodels(model: NoiseModel, y: Array) -> None:
    from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

    space = model.state_space(1 / RATE, record=N_SAMPLES / RATE).with_constant()
    n = space.size
    theirs = KalmanFilter(1, n, design=space.output[None], transition=space.transition, selection=np.eye(n))
    theirs.bind(y[None, :].copy())
    theirs["obs_cov"], theirs["state_cov"] = [[space.noise]], space.process
    theirs.initialize_known(np.zeros(n), space.initial + np.diag(1.0 * space.diffuse))
    theirs.filter()


def filterpy(model: NoiseModel, y: Array) -> None:
    from filterpy.kalman import KalmanFilter

    space = model.state_space(1 / RATE, record=N_SAMPLES / RATE).with_constant()
    theirs = KalmanFilter(dim_x=space.size, dim_z=1)
    theirs.F, theirs.Q, theirs.H = space.transition, space.process, space.output[None]
    theirs.R = np.array([[space.noise]])
    theirs.P = space.initial + np.diag(1.0 * space.diffuse)
    rows, h = np.empty((len(y), 2)), space.output
    for k, value in enumerate(y):
        theirs.update(value)
        rows[k] = (h @ theirs.x).item(), h @ theirs.P @ h
        theirs.predict()


def contenders() -> dict[str, tuple[int, int, Callable[[Array], None]]]:
    """Samples, one missing in how many, and what is done with them."""
    made: dict[str, tuple[int, int, Callable[[Array], None]]] = {}
    for name, model in MODELS.items():
        made[name] = N_SAMPLES, 0, lambda y, model=model: ours(model, y)
        made[f"{name}, a sample missing each minute"] = (
            N_SAMPLES // 4,
            1920,
            lambda y, model=model: ours(model, y),
        )
        made[f"{name}, row by row"] = N_SAMPLES // 4, 0, lambda y, model=model: ours(model, y, segments=False)
        if importlib.util.find_spec("statsmodels"):
            made[f"{name}, statsmodels"] = STRETCH, 0, lambda y, model=model: statsmodels(model, y)
        if importlib.util.find_spec("filterpy"):
            made[f"{name}, filterpy"] = STRETCH, 0, lambda y, model=model: filterpy(model, y)
    return made


def measure_here(name: str) -> dict[str, Any]:
    n, gap_every, contender = contenders()[name]
    contender(samples(2000))  # imports are not timed
    before = resident_bytes()
    y = samples(n, gap_every)
    start = time.process_time()
    contender(y)
    seconds = time.process_time() - start
    beyond = peak_bytes() - before - y.nbytes
    return {"n_samples": n, "nanoseconds": 1e9 * seconds / n, "megabytes": beyond / 1e6}


def main() -> None:
    best = best_runs("filter_speed", contenders(), ROUNDS, "nanoseconds")
    packages = [name for name in ("statsmodels", "filterpy") if importlib.util.find_spec(name)]
    notes = [
        "processor time of one thread, best of four; memory beyond the samples, without the temporary file",
        "estimates and standard deviations agree with the filter row by row to 1e-9 standard deviations",
    ]
    result = {"machine": describe(*packages), "contenders": best, "notes": notes}
    rows = [
        [name, str(run["n_samples"]), f"{run['nanoseconds']:.0f}", f"{run['megabytes']:.0f}"]
        for name, run in best.items()
    ]
    header = ["model", "samples", "ns per sample", "MB"]
    print(save("filter_speed", "filter_recording, a week at 32 Hz", result, header, rows))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(measure_here(sys.argv[1])))
    else:
        main()
