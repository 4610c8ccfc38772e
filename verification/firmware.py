# SPDX-License-Identifier: BSD-3-Clause
"""The exported C++ filter against the Python filter over a day: 2.76 million samples at 32 Hz, in double and in float.

The header that `al.export("cpp", ...)` writes is compiled on this machine (firmware/replay.cpp) and fed a simulated
record with a bias, gaps and everything; the Python filter runs the same model in double, in its square-root form. Both
tell all their states every 1000 samples. Differences are counted in standard deviations of the state, by the Python
filter.

In double a billionth of a standard deviation is allowed: rounding alone is far below. In float the factors of the
covariance are rounded too, which makes gains wrong by 1e-4 and the states by more than their own roundings; the gate is
what a user can feel: a twentieth of the filter's standard deviation adds an eighth of a percent to its error.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.filtering.kalman.filtering import FilterRun
from allanite.noise import Flicker, NoiseModel, Quantisation, RandomWalk, StateSpace, White

__all__ = ["CASES", "EVERY", "RATE", "constants", "replayed", "run_firmware", "space_of"]

Json = dict[str, Any]
Array = NDArray[np.float64]
ROOT = Path(__file__).resolve().parent.parent
DEG = math.pi / 180
RATE, DAY, EVERY = 32.0, 86_400.0, 1000
#: Largest difference, in standard deviations of the state.
GATES = {"double": 1e-9, "float": 0.05}

_GYRO = NoiseModel.of(White(N=0.3 * DEG / 60), Flicker(B=5 * DEG / 3600), RandomWalk(K=5 * DEG / 3600 / 60))
CASES: Mapping[str, tuple[NoiseModel, Json]] = {
    "MEMS gyro, flicker over 10 min": (_GYRO, {"horizon": 600.0}),
    "MEMS gyro, flicker over a day": (_GYRO, {"horizon": DAY}),
    "MEMS gyro, one state for flicker": (_GYRO, {"flicker": "single", "correlation_time": 100.0}),
    "quantised gyro without K": (
        NoiseModel.of(Quantisation(Q=2e-6, dt=1 / RATE), White(N=2e-5), Flicker(B=1e-6)), {"horizon": 3600.0},
    ),
}  # fmt: skip


def run_firmware(seed: int, say: Callable[[str], None], duration: float = DAY) -> list[Json]:
    """One row for each case and precision; none where there is no g++."""
    if not (shutil.which("g++") and shutil.which("make")):
        say("no g++ and make: the firmware filter was not run")
        return []
    rows = []
    for number, (name, (model, options)) in enumerate(CASES.items()):
        y = _record(model, duration, np.random.SeedSequence([seed, number]))
        texts = {scalar: _exported(model, scalar, options) for scalar in GATES}
        truth = _python(space_of(texts["double"]), constants(texts["double"])["start_gain"], y)
        for scalar, text in texts.items():
            rows.append({"case": name, "scalar": scalar, **_compared(replayed(text, y), *truth, y, scalar)})
            say(
                f"{name}, {scalar}: {rows[-1]['states_in_sd']:.2g} sd, {rows[-1]['bias_in_samples']:.2g} of the sample"
            )
    return rows


def _exported(model: NoiseModel, scalar: str, options: Json) -> str:
    return al.export("cpp", {"gyro": model}, rate=RATE, scalar=scalar, **options)


def _record(model: NoiseModel, duration: float, seed: np.random.SeedSequence) -> Array:
    """A bias of 50 deg/h and the noise, with ten minutes missing in every hour."""
    record = al.simulate(model, rate=RATE, duration=duration, seed=int(seed.generate_state(1)[0]))
    y = record.values("gyro") + 50 * DEG / 3600
    y[(np.arange(len(y)) % round(3600 * RATE)) >= round(3000 * RATE)] = np.nan
    return np.asarray(y)


def constants(text: str) -> dict[str, Array]:
    """The arrays and numbers of a model, as a compiler reads them; not those of the kernels before it."""
    found, own = {}, text[text.index("constexpr int n_states") :]
    for name, values in re.findall(r"^constexpr \w+ (\w+)(?:\[[^]]*\])? = \{?([^;}]*)\}?;", own, re.M):
        found[name] = np.array([float(x.rstrip("F")) for x in values.replace("\n", " ").split(",")])
    return found


def space_of(text: str) -> StateSpace:
    """The exported model as a StateSpace after its first sample."""
    c = constants(text)
    n = int(c["n_states"][0])
    return StateSpace(
        transition=c["transition"].reshape(n, n),
        process=c["process"].reshape(n, n),
        output=c["output"],
        noise=float(c["noise"][0]),
        initial=c["start_covariance"].reshape(n, n),
        rate=c["bias_of_states"],
        labels=("x",) * n,
        diffuse=np.zeros(n, dtype=np.bool_),
    )


def _python(space: StateSpace, start_gain: Array, y: Array) -> tuple[Array, Array, Array]:
    """Bias, states and standard deviations of both, predicted for the next sample, every so many samples."""
    f = space.transition
    ahead = f @ space.initial @ f.T + space.process
    later = StateSpace(
        transition=f, process=space.process, output=space.output, noise=space.noise, initial=ahead,
        rate=space.rate, labels=space.labels, diffuse=space.diffuse,
    )  # fmt: skip
    run = FilterRun(later, form="square root", state=f @ (start_gain * y[0]))
    states, sds = [], []
    for stop in range(EVERY, len(y) + 1, EVERY):
        run.feed(y[max(stop - EVERY, 1) : stop], readout=False, innovations=False)
        covariance = run.covariance
        states.append(run.state)
        sds.append(np.sqrt([space.rate @ covariance @ space.rate, *np.diag(covariance)]))
    found = np.array(states)
    return found @ space.rate, found, np.array(sds)


def replayed(text: str, y: Array, every: int = EVERY, *, gate: float = 0.0, optimise: str = "-O1") -> Array:
    """What the compiled header makes of a record: bias, its variance and the states, shape (m, n + 2)."""
    with tempfile.TemporaryDirectory(prefix="allanite.") as place:
        (Path(place) / "model.hpp").write_text(text, encoding="utf-8")
        subprocess.run(
            [
                *("make", "-s", "-C", str(ROOT / "firmware"), "replay"),
                *(f"BUILD={place}", f"MODEL={place}", f"OPTIMISE={optimise}"),
            ],
            check=True,
        )
        done = subprocess.run(
            [Path(place) / "replay", str(every), str(gate)],
            input=y.tobytes(),
            stdout=subprocess.PIPE,
            check=True,
        )
    return np.frombuffer(done.stdout).reshape(len(y) // every, -1)


def _compared(found: Array, bias: Array, states: Array, sds: Array, y: Array, scalar: str) -> Json:
    known = sds[:, 1:] > 0
    wrong = np.abs(found[:, 2:] - states)[known] / sds[:, 1:][known]
    in_sd = max(float(wrong.max()), float((np.abs(found[:, 0] - bias) / sds[:, 0]).max()))
    in_samples = float(np.abs(found[:, 0] - bias).max() / np.nanmax(np.abs(y)))
    spread = float(np.abs(np.sqrt(found[:, 1]) / sds[:, 0] - 1).max())
    return {
        "samples": len(y),
        "states": states.shape[1],
        "states_in_sd": float(f"{in_sd:.3g}"),
        "bias_in_samples": float(f"{in_samples:.3g}"),
        "sd_off_by": float(f"{spread:.3g}"),
        "passes": in_sd <= GATES[scalar],
    }
