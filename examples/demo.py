# SPDX-License-Identifier: BSD-3-Clause
"""A week of the gyro of the seed paper: simulate it, characterise it, compare with the truth.

The sensor is the SiRRS01-03 MEMS gyro as Silva, Jeronymo, Pavan and Tosin published it: white noise N, a first-order
Gauss-Markov bias (B, T_b) and a rate random walk K, sampled at 32 Hz for seven days (19 353 600 samples).

Run it with ``make demo``, or ``python examples/demo.py --out demo`` where allanite is installed.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

import allanite as al
from allanite.noise import SIGMA_PER_B, GaussMarkov, RandomWalk, White

RATE = 32.0  # Hz
WEEK = 7 * 86400.0  # s
DEG = math.pi / 180
# The published values: deg/sqrt(s), deg/s, s, deg/s^1.5.
N, B, T_B, K = 0.0122, 0.0027, 238.1, 6.8314e-5

WHY_NOT_THE_MINIMUM = """\
T_b is not read off the minimum of the curve: white noise and random walk shift that minimum (here to 105 s, not
to 1.89 T_b = 450 s), so minimum/1.89 would say 55 s. The fit uses the whole curve with its covariance instead."""


def say(text: str, since: float) -> None:
    """Progress, on stderr: stdout is for the result."""
    sys.stderr.write(f"[{time.perf_counter() - since:5.1f} s] {text}\n")
    sys.stderr.flush()


def sensor() -> al.NoiseModel:
    """The published gyro, in SI."""
    bias = GaussMarkov.from_sigma(SIGMA_PER_B * B * DEG, T_B)
    return al.NoiseModel.of(White(N=N * DEG), bias, RandomWalk(K=K * DEG))


def comparison(study: al.Study) -> str:
    """Estimate (95 % interval) beside the truth, one line per parameter, in the units of the paper."""
    (model,) = study.models.values()
    rows = [("N", "N", "deg/√s", DEG, N), ("B", "B_equiv", "deg/s", DEG, B), ("T_b", "T", "s", 1.0, T_B)]
    rows.append(("K", "K", "deg/s/√s", DEG, K))
    lines = [f"{'':4} {'unit':9} {'estimate':>11} {'95 % interval':^25} {'truth':>11}"]
    for name, symbol, unit, factor, truth in rows:
        found = model.estimate(symbol)
        if found is None or found.value is None:
            lines.append(f"{name:4} {unit:9} {'not resolved':>11} {'':25} {truth:11.5g}")
            continue
        interval = f"{found.lower / factor:.5g} to {found.upper / factor:.5g}"
        inside = "" if found.lower <= truth * factor <= found.upper else "  outside"
        lines.append(f"{name:4} {unit:9} {found.value / factor:11.5g} {interval:^25} {truth:11.5g}{inside}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description="Simulate and characterise a week of the gyro of the seed paper."
    )
    parser.add_argument("--out", type=Path, default=Path("demo"), help="folder for the results")
    parser.add_argument("--duration", type=float, default=WEEK, help="seconds to simulate")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()

    say(f"simulating {options.duration / 86400:g} days at {RATE:g} Hz", start)
    record = al.simulate(sensor(), rate=RATE, duration=options.duration, seed=options.seed)
    say(f"characterising {record.n_samples} samples", start)
    study = al.characterize(record)
    say(f"writing {out}/", start)
    study.save(out / "study.json", force=True)
    al.render(study, out / "report.html", force=True)
    al.allan_curve(record).to_csv(out / "allan.csv", force=True)
    al.export("kalibr", study, out / "imu.yaml", force=True)
    al.plot(study).savefig(out / "curve.png", dpi=150)
    say("done", start)

    sys.stdout.write(f"{comparison(study)}\n\n{WHY_NOT_THE_MINIMUM}\n\nReport: {out / 'report.html'}\n")


if __name__ == "__main__":
    main()
