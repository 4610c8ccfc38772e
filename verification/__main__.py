# SPDX-License-Identifier: BSD-3-Clause
"""`make verify`: run the scenarios, write the table and the picture of the results."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: one record per process, one thread each

import argparse
import json
from datetime import UTC, datetime
from pathlib import Path

from verification.coverage import ROOT_SEED, evaluate, run
from verification.curves import LAGS, run_curves
from verification.report import write_curves, write_report
from verification.scenarios import SCENARIOS

HERE = Path(__file__).parent


def main() -> None:
    """Command line of the verification runs."""
    parser = argparse.ArgumentParser(prog="python -m verification", description=__doc__)
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", action="append", help="name of a scenario; may be repeated")
    parser.add_argument("--curves", action="store_true", help="only the intervals of the curve")
    parser.add_argument(
        "--cache", type=Path, default=HERE / "cache", help="records already done are kept here"
    )
    given = parser.parse_args()
    today = datetime.now(UTC).date().isoformat()
    if given.curves or not given.only:
        curves = run_curves(ROOT_SEED, lambda text: print(text, flush=True))
        write_curves(curves, LAGS.tolist(), HERE / "results", seed=ROOT_SEED, date=today)
    if given.curves:
        return
    given.cache.mkdir(exist_ok=True)
    chosen = [s for s in SCENARIOS if not given.only or s.name in given.only]
    rows = []
    for scenario in chosen:
        rows.append(evaluate(scenario, run(scenario.name, given.runs, given.workers, given.cache)))
        print(json.dumps(rows[-1], indent=1), flush=True)
    if len(chosen) == len(SCENARIOS):
        write_report(rows, HERE / "results", seed=ROOT_SEED, date=today)


if __name__ == "__main__":
    main()
