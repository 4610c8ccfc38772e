# SPDX-License-Identifier: BSD-3-Clause
"""`make verify`: run the long statistical checks, write the tables and pictures of the results."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: one record per process, one thread each

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from verification.coverage import ROOT_SEED

HERE = Path(__file__).parent


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """What was asked for: `share` of the full number of records, processes, and where finished records are kept."""

    share: float
    workers: int
    cache: Path
    date: str

    def count(self, full: int) -> int:
        """Records of a run that has `full` of them."""
        return max(round(self.share * full), 2)


def _say(text: str) -> None:
    print(text, flush=True)


def _curves(order: Order) -> None:
    from verification.curves import LAGS, run_curves
    from verification.report import write_curves

    write_curves(
        run_curves(ROOT_SEED, _say), LAGS.tolist(), HERE / "results", seed=ROOT_SEED, date=order.date
    )


def _coverage(order: Order) -> None:
    from verification.coverage import evaluate, run
    from verification.report import write_report
    from verification.scenarios import SCENARIOS

    rows = []
    for scenario in SCENARIOS:
        rows.append(evaluate(scenario, run(scenario.name, order.count(500), order.workers, order.cache)))
        _say(json.dumps(rows[-1], indent=1))
    write_report(rows, HERE / "results", seed=ROOT_SEED, date=order.date)


def _earth(order: Order) -> None:
    from verification.earth_rate import run_faults, run_takes, run_warm_up
    from verification.earth_report import write_earth
    from verification.turns import run as run_turns

    parts = {
        "takes": run_takes(order.count(1000), ROOT_SEED, _say, order.workers, order.cache),
        "turns": run_turns(order.count(200), ROOT_SEED),
        "faults": run_faults(order.count(60), ROOT_SEED, _say, order.workers, order.cache),
        "warm_up": run_warm_up(order.count(100), ROOT_SEED, _say, order.workers, order.cache),
    }
    write_earth(parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _north(order: Order) -> None:
    from verification.north import run_budget, run_circle, run_indexing
    from verification.planning import run_planning
    from verification.tables import write_tables

    parts = {
        "Interval of a direction, by the signal over the noise of one component": run_circle(
            ROOT_SEED, _say, order.count(100_000)
        ),
        "Azimuth in noise that wanders while the table is turned": run_indexing(
            ROOT_SEED, _say, order.count(2000)
        ),
        "Budget against simulation": run_budget(ROOT_SEED, _say, order.count(2000)),
        "Plan against simulation": run_planning(ROOT_SEED, _say, order.count(2000)),
    }
    write_tables("north", "North and planning", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _rate_vector(order: Order) -> None:
    from verification.rate_vector import run_rate_vector
    from verification.tables import write_tables

    rows = run_rate_vector(ROOT_SEED, _say, records=order.count(1000), workers=order.workers)
    parts = {"Coverage of the 95 % interval of the length": rows}
    title = "Rate vector of a vehicle at rest"
    write_tables("rate_vector", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _rate_table(order: Order) -> None:
    from verification.rate_table import run_rate_table
    from verification.tables import write_tables

    rows = run_rate_table(ROOT_SEED, _say, records=order.count(1000), workers=order.workers)
    parts = {"Coverage of the 95 % intervals": rows}
    title = "Response to a rate table"
    write_tables("rate_table", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _triad(order: Order) -> None:
    from verification.tables import write_tables
    from verification.triad import run_triad

    parts = run_triad(order.count(1000), ROOT_SEED, _say, order.workers, order.cache)
    title = "Calibration and alignment of a unit"
    write_tables("triad", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _alignment(order: Order) -> None:
    from verification.alignment import run_battery
    from verification.tables import write_tables

    parts = {"Battery": run_battery(ROOT_SEED, _say, order.count(2000))}
    title = "Alignment against the test battery"
    write_tables("alignment", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _positions(order: Order) -> None:
    from verification.position_planning import run_position_planning
    from verification.tables import write_tables

    parts = {"Planned against simulated": run_position_planning(ROOT_SEED, _say, order.count(1000))}
    title = "Positions of a calibration, planned"
    write_tables("position_planning", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _redundancy(order: Order) -> None:
    from verification.redundancy import run_false_alarms, run_faults, run_intervals
    from verification.tables import write_tables

    parts = {
        "False alarms, stated 5 % of records; shared noise where there is none, stated 1 %": run_false_alarms(
            ROOT_SEED, _say, order.count(1000)
        ),
        "Coverage of 95 % intervals": run_intervals(ROOT_SEED, _say, order.count(1000)),
        "Faults of one of six gyros": run_faults(ROOT_SEED, _say, order.count(200)),
    }
    title = "Redundant sensors"
    write_tables("redundancy", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _limits(_: Order) -> None:
    from verification.what_the_data_can_tell import main as write

    write()


PARTS: dict[str, Callable[[Order], None]] = {
    "curves": _curves,
    "coverage": _coverage,
    "earth": _earth,
    "north": _north,
    "rate-vector": _rate_vector,
    "rate-table": _rate_table,
    "triad": _triad,
    "alignment": _alignment,
    "positions": _positions,
    "redundancy": _redundancy,
    "limits": _limits,
}


def main() -> None:
    """Command line of the verification runs."""
    parser = argparse.ArgumentParser(prog="python -m verification", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="part", help=f"of {', '.join(PARTS)}; all by default")
    parser.add_argument("--share", type=float, default=1.0, help="of the full number of records")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--cache", type=Path, default=HERE / "cache", help="records already done are kept here"
    )
    given = parser.parse_args()
    unknown = set(given.parts) - set(PARTS)
    if unknown:
        parser.error(f"no part {', '.join(unknown)}; there are: {', '.join(PARTS)}")
    given.cache.mkdir(exist_ok=True)
    today = datetime.now(UTC).date().isoformat()
    order = Order(share=given.share, workers=given.workers, cache=given.cache, date=today)
    for name in given.parts or PARTS:
        PARTS[name](order)


if __name__ == "__main__":
    main()
