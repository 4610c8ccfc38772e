# SPDX-License-Identifier: BSD-3-Clause
"""`make verify`: run the long statistical checks, write the tables and pictures of the results."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: one record per process, one thread each

import argparse
import json
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from verification.coverage import ROOT_SEED

HERE = Path(__file__).parent
Json = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """What was asked for: `share` of the full number of records, processes, and where finished records are kept.

    `only` is a pattern of scenarios; the rows of others stay as they are.
    """

    share: float
    only: str
    workers: int
    cache: Path
    date: str

    def count(self, full: int) -> int:
        """Records of a run that has `full` of them."""
        return max(round(self.share * full), 2)

    def beside_others(
        self, result: str, part: str, rows: list[Json], key: str, names: Sequence[str]
    ) -> list[Json]:
        """New rows, and of the committed part of a result those whose names were not asked for, in one order."""
        made = {row[key] for row in rows}
        committed = json.loads((HERE / "results" / f"{result}.json").read_text()) if self.only else {}
        others = [row for row in committed.get(part, []) if row[key] not in made]
        if missing := set(names) - made - {row[key] for row in others}:
            sys.exit(
                f"{result} has no rows of {', '.join(sorted(missing))}: run the part without --only first"
            )
        return sorted([*others, *rows], key=lambda row: names.index(row[key]))


def _say(text: str) -> None:
    print(text, flush=True)


def _curves(order: Order) -> None:
    from verification.curves import LAGS, run_curves
    from verification.report import write_curves

    write_curves(
        run_curves(ROOT_SEED, _say), LAGS.tolist(), HERE / "results", seed=ROOT_SEED, date=order.date
    )


def _fits(order: Order) -> None:
    from verification.coverage import evaluate
    from verification.fits import ALL, BY_CURVE, BY_SAMPLES, BY_TERMS, errors_over_bound, run_fits
    from verification.report import write_report
    from verification.tables import write_tables

    chosen = [s for s in ALL if re.search(order.only, s.name)]
    made = run_fits(chosen, ROOT_SEED, _say, order.count(1200), order.workers, order.cache)
    untold = [s.name for s in ALL if not s.terms]
    named = {
        "coverage": ("Coverage of the 95 % sets of the fit of the curve", BY_CURVE),
        "likelihood_coverage": ("Coverage of the 95 % sets of the fit of the samples", BY_SAMPLES),
    }
    for name, (title, method) in named.items():
        rows = [
            evaluate(s, [record[BY_TERMS if s.terms else method] for record in made[s.name]])
            for s in chosen
            if not s.terms or method == BY_SAMPLES
        ]
        names = untold if method == BY_CURVE else [s.name for s in ALL]
        rows = order.beside_others(name, "scenarios", rows, "name", names)
        write_report(name, title, rows, HERE / "results", seed=ROOT_SEED, date=order.date)
    heading = "Errors over the bound"
    rows = order.beside_others("default_fits", heading, errors_over_bound(made), "scenario", untold)
    parts = {heading: rows}
    title = "Errors of fits that are given nothing"
    write_tables("default_fits", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


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


def _fleet(order: Order) -> None:
    from verification.fleet import run_discoveries, run_law, run_samples
    from verification.tables import write_tables

    parts = {
        "Coverage of the 95 % intervals, logs by their law": run_law(
            ROOT_SEED, _say, order.count(1200), order.workers, order.cache
        ),
        "Coverage of the 95 % intervals, logs from samples": run_samples(
            ROOT_SEED, _say, order.count(500), order.workers, order.cache
        ),
        "Units that stand out, at a false discovery rate of 5 %": run_discoveries(
            ROOT_SEED, _say, order.count(300), order.workers, order.cache
        ),
    }
    write_tables("fleet", "Population of a fleet", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _sensors(order: Order) -> None:
    from verification.sensors import draw_ranks, run_coverage, run_ranks, run_sensors
    from verification.tables import write_tables

    made = run_sensors(ROOT_SEED, _say, order.count(2000), order.workers, order.cache)
    ranks = run_ranks(made)
    parts = {
        "Coverage of sets at five levels": run_coverage(made),
        "Ranks of coefficients that every set resolves": ranks,
    }
    title = "Sensors drawn from a prior"
    draw_ranks(ranks, HERE / "results" / "sensors.png")
    write_tables("sensors", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _fleet_check(order: Order) -> None:
    from verification.fleet_check import run_at_the_limit
    from verification.tables import write_tables

    parts = {
        "Units with N, B and K at their limits": run_at_the_limit(
            ROOT_SEED, _say, order.count(400), order.workers, order.cache
        )
    }
    title = "Bench test of a unit"
    write_tables("fleet_check", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


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


def _calibration(order: Order) -> None:
    from verification.calibration import run_calibration
    from verification.tables import write_tables

    parts = run_calibration(order.count(1000), ROOT_SEED, _say, order.workers, order.cache)
    title = "Calibration and alignment of a unit"
    write_tables("calibration", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _hand_held(order: Order) -> None:
    from verification.hand_held_calibration import run_hand_held
    from verification.tables import write_tables

    parts = run_hand_held(order.count(1200), ROOT_SEED, _say, order.workers, order.cache)
    title = "Hand-held calibration"
    write_tables("hand_held", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


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


def _likelihood(order: Order) -> None:
    from verification.likelihood import run_chain, run_errors
    from verification.tables import write_tables

    count, workers = order.count(1000), order.workers
    few = order.count(100)
    parts = {
        "Error over the Cramer-Rao bound": run_errors(count, ROOT_SEED, _say, workers, order.cache),
        "The short chain against the whole one": run_chain(few, ROOT_SEED, _say, workers, order.cache),
    }
    title = "Likelihood"
    write_tables("likelihood", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _overbound(order: Order) -> None:
    from verification.overbound import run_overbound
    from verification.tables import write_tables

    parts = run_overbound(order.count(400), ROOT_SEED, _say, order.workers, order.cache)
    title = "Bounds above the truth"
    write_tables("overbound", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _variation(order: Order) -> None:
    from verification.tables import write_tables
    from verification.variation import run_changes, run_constant

    parts = {
        "Constant noise, said to change in at most 5 % of records": run_constant(
            ROOT_SEED, _say, order.count(1000), order.workers, order.cache
        ),
        "Noise that changes": run_changes(ROOT_SEED, _say, order.count(1000), order.workers, order.cache),
    }
    title = "Deviation over time"
    write_tables("variation", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _scoreboard(order: Order) -> None:
    from verification.scoreboard.accuracy import run_accuracy
    from verification.scoreboard.bars import run_bars
    from verification.scoreboard.cost import BILLION, WEEK, run_billion, run_week
    from verification.scoreboard.hardships import run_hardships
    from verification.scoreboard.page import write_page
    from verification.scoreboard.picture import draw
    from verification.tables import write_tables

    parts = {
        "A week at 32 Hz": run_week(order.count(WEEK), _say, order.cache),
        "A billion samples": run_billion(order.count(BILLION), _say, order.cache),
        "What records are like": run_hardships(ROOT_SEED),
        "Bars of the curve": run_bars(order.count(600), ROOT_SEED, _say),
        "Parameters": run_accuracy(order.count, ROOT_SEED, _say, order.workers, order.cache),
    }
    write_tables("scoreboard", "Scoreboard", parts, HERE / "results", seed=ROOT_SEED, date=order.date)
    draw(parts, HERE / "results" / "scoreboard.png")
    write_page(parts, HERE.parent / "docs" / "scoreboard.md", seed=ROOT_SEED, date=order.date)


def _battery(order: Order) -> None:
    from verification.battery import run_battery
    from verification.tables import write_tables

    parts = run_battery(order.count, ROOT_SEED, _say, order.workers)
    title = "Rows of the test battery that need many records"
    write_tables("battery", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _comparison(order: Order) -> None:
    from verification.comparison import run_power, run_size
    from verification.tables import write_tables

    workers, cache = order.workers, order.cache
    parts = {
        "Records of one noise called different at 5 %": run_size(
            ROOT_SEED, _say, order.count(1000), workers, cache
        ),
        "One record of five differs": run_power(ROOT_SEED, _say, order.count(300), workers, cache),
    }
    title = "Comparison of records"
    write_tables("comparison", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _kind_of_sensor(order: Order) -> None:
    from verification.comparison import run_coverage
    from verification.tables import write_tables

    rows = run_coverage(ROOT_SEED, _say, order.count(1000), order.workers, order.cache)
    parts = {"Coverage of 95 % intervals of the kind of sensor": rows}
    title = "Kind of sensor"
    write_tables("kind_of_sensor", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _environment(order: Order) -> None:
    from verification.environment import run_coverage, run_warm_up
    from verification.tables import write_tables

    parts = {
        "Coverage of the 95 % interval of the temperature coefficient": run_coverage(
            order.count(2000), ROOT_SEED, _say, order.workers, order.cache
        ),
        "Warm-ups found, without one and with one (+ amplitude in units of N)": run_warm_up(
            order.count(500), ROOT_SEED, _say, order.workers, order.cache
        ),
    }
    title = "Effects of the environment"
    write_tables("environment", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _statistics(order: Order) -> None:
    from verification.statistics import (
        LAGS,
        run_alone,
        run_bias,
        run_coverage,
        run_gain,
        run_gaps,
        run_outliers,
    )
    from verification.tables import write_tables

    parts = {
        f"Coverage of 68.27 % intervals under the model, {name}": run_coverage(
            name, ROOT_SEED, _say, order.count(10_000)
        )
        for name in LAGS
    }
    parts |= {
        "Coverage with a tenth missing": run_gaps(ROOT_SEED, _say, order.count(2000)),
        "Coverage of 68.27 % intervals of the curve alone": run_alone(ROOT_SEED, _say, order.count(2000)),
        "Degrees of freedom, 1024 samples": run_gain(),
        "Allan variance over Theo1": run_bias(),
        "Variance over truth under outliers": run_outliers(ROOT_SEED, _say, order.count(100)),
    }
    title = "Theo1, Haar and robust variance"
    write_tables("statistics", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _spectrum(order: Order) -> None:
    from verification.spectrum import run_intervals, run_lines, run_power
    from verification.tables import write_tables

    many, workers, cache = order.count(1200), order.workers, order.cache
    parts = {
        "Coverage of the 95 % intervals of a density": run_intervals(ROOT_SEED, _say, many, workers, cache),
        "A sinusoid in coloured noise": run_lines(ROOT_SEED, _say, many, workers, cache),
        "Lags and frequencies said to disagree where something is wrong": run_power(
            ROOT_SEED, _say, order.count(300), workers, cache
        ),
    }
    write_tables("spectrum", "Spectra", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _spectral_fits(order: Order) -> None:
    from verification.spectrum import run_fits
    from verification.tables import write_tables

    fits, false, alarms = run_fits(ROOT_SEED, _say, order.count(1200), order.workers, order.cache)
    parts = {
        "Coverage and efficiency": fits,
        "Declarations and time": false,
        "Lags and frequencies said to disagree though the record is noise (at most 5 %)": alarms,
    }
    write_tables("spectral_fits", "Spectral fit", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _shared_noise(order: Order) -> None:
    from verification.shared_noise import run_shared_noise
    from verification.tables import write_tables

    rows = run_shared_noise(ROOT_SEED, _say, order.count(2000), order.workers, order.cache)
    parts = {"Coverage of the 95 % intervals of every part": rows}
    title = "Two and three sensors taken apart"
    write_tables("shared_noise", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _selection(order: Order) -> None:
    from verification.selection import run_lines, run_population, run_scenarios
    from verification.tables import write_tables

    scenarios = run_scenarios(ROOT_SEED, _say, order.count(1000), order.workers, order.cache)
    terms, sets = run_population(ROOT_SEED, _say, order.count(3000), order.workers, order.cache)
    parts = {
        "Right set of terms first, and absent terms called present": scenarios,
        "Weight of a term, and how often it was there": terms,
        "Weight of the first set, and how often it was the whole truth": sets,
        "Records without a line": run_lines(ROOT_SEED, _say, order.count(1000), order.workers, order.cache),
    }
    write_tables("selection", "Selection of terms", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _recording(order: Order) -> None:
    from verification.capture import run_drift, run_stopped
    from verification.log_store import (
        run_cost,
        run_cuts,
        run_deaths,
        run_disks,
        run_flips,
        run_full,
        run_monitor,
        run_week,
    )
    from verification.serial_imu import run_held, run_streams
    from verification.tables import write_tables

    parts = {
        "Q1: killed at random moments": run_deaths(order.count(200), ROOT_SEED, _say),
        "Q2: cut at every byte of the last batches": run_cuts(),
        "Q2: every bit of a batch and of the opening": run_flips(),
        "Q3: failures of the disk (strace)": run_disks(_say),
        "Q4: /dev/full": run_full(),
        "Q13: a week at 32 Hz": run_week(order.share),
        "Cost of a batch": run_cost(),
        "Cost of watching a run": run_monitor(order.share),
        "Frames out of faulty streams": run_streams(order.count(300), ROOT_SEED),
        "Six channels at 2 kHz over a pty": run_held(600.0 * order.share),
        "The recorder is stopped for three seconds": run_stopped(3.0),
        "A meter armed again whose clock drifts": run_drift(),
    }
    write_tables("recording", "Recording", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _firmware(order: Order) -> None:
    from verification.firmware import DAY, run_firmware
    from verification.tables import write_tables

    parts = {
        "The compiled filter against Python, a day at 32 Hz": run_firmware(ROOT_SEED, _say, DAY * order.share)
    }
    write_tables("firmware", "Firmware", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _dead_reckoning(order: Order) -> None:
    from verification.dead_reckoning import run_dead_reckoning
    from verification.tables import write_tables

    parts = {
        "Budget against strapdown simulations": run_dead_reckoning(ROOT_SEED, _say, units=order.count(4000))
    }
    write_tables("dead_reckoning", "Dead reckoning", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _hostile_files(order: Order) -> None:
    from verification.hostile_files import run_mutations, run_shapes
    from verification.tables import write_tables

    parts = {
        "Changed, cut and crafted files": run_mutations(records=order.count(2000)),
        "Wide, deep and lying files": run_shapes(),
    }
    write_tables("hostile_files", "Hostile files", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _findings(order: Order) -> None:
    from verification.findings import TITLE, look_alikes_page, run_look_alikes
    from verification.tables import write_tables

    parts = {TITLE: run_look_alikes(order.count(200), ROOT_SEED, _say)}
    write_tables(
        "findings", "Findings and their look-alikes", parts, HERE / "results", seed=ROOT_SEED, date=order.date
    )
    page = HERE.parent / "docs" / "reference" / "look-alikes.md"
    page.write_text(look_alikes_page(), encoding="utf-8")


def _page(order: Order) -> None:
    from verification.page import run_held, run_streams
    from verification.tables import write_tables

    parts = {
        "Answers while others hold connections": run_held(300.0 * order.share, _say),
        "Answers beside event streams of one session": run_streams(_say),
    }
    write_tables("page", "The page", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _floor(order: Order) -> None:
    from verification.floor import run_floor
    from verification.tables import write_tables

    parts = {
        "Coverage with the instrument's own noise removed": run_floor(
            ROOT_SEED, _say, order.count(1000), order.workers, order.cache
        )
    }
    write_tables("floor", "Noise of the instrument", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _held(order: Order) -> None:
    from verification.held import run_alarms, run_held
    from verification.tables import write_tables

    count, workers = order.count(1200), order.workers
    parts = {
        "Rate, and coverage of the 95 % interval of N": run_held(
            ROOT_SEED, _say, count, workers, order.cache
        ),
        "Records of which no value is held": run_alarms(ROOT_SEED, _say, count, workers, order.cache),
    }
    write_tables("held", "Held samples", parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _wrong_models(order: Order) -> None:
    from verification.right_models import run_right_models
    from verification.tables import write_tables
    from verification.wrong_models import run_wrong_models

    parts = run_wrong_models(ROOT_SEED, _say, order.count(300), order.workers, order.cache)
    parts["Where a family is right, by the curve"] = run_right_models(
        ROOT_SEED, _say, order.count(300), order.workers, order.cache
    )
    title = "When the model is wrong"
    write_tables("wrong_models", title, parts, HERE / "results", seed=ROOT_SEED, date=order.date)


def _contaminated(order: Order) -> None:
    from verification.contaminated import run_contaminated, run_look_alikes
    from verification.tables import write_tables

    count, workers = order.count(1200), order.workers
    parts = {
        "Coverage of the 95 % intervals of N": run_contaminated(ROOT_SEED, _say, count, workers, order.cache),
        "Look-alikes": run_look_alikes(ROOT_SEED, _say, count, workers, order.cache),
    }
    write_tables(
        "contaminated", "Contaminated noise", parts, HERE / "results", seed=ROOT_SEED, date=order.date
    )


def _limits(_: Order) -> None:
    from verification.what_the_data_can_tell import main as write

    write()


PARTS: dict[str, Callable[[Order], None]] = {
    "curves": _curves,
    "held": _held,
    "contaminated": _contaminated,
    "wrong_models": _wrong_models,
    "fits": _fits,
    "earth": _earth,
    "north": _north,
    "rate-vector": _rate_vector,
    "sensors": _sensors,
    "fleet": _fleet,
    "fleet-check": _fleet_check,
    "rate-table": _rate_table,
    "calibration": _calibration,
    "hand-held calibration": _hand_held,
    "alignment": _alignment,
    "positions": _positions,
    "redundancy": _redundancy,
    "spectrum": _spectrum,
    "spectral-fits": _spectral_fits,
    "environment": _environment,
    "comparison": _comparison,
    "kind-of-sensor": _kind_of_sensor,
    "variation": _variation,
    "shared-noise": _shared_noise,
    "selection": _selection,
    "likelihood": _likelihood,
    "overbound": _overbound,
    "battery": _battery,
    "statistics": _statistics,
    "recording": _recording,
    "firmware": _firmware,
    "dead-reckoning": _dead_reckoning,
    "findings": _findings,
    "hostile-files": _hostile_files,
    "page": _page,
    "floor": _floor,
    "limits": _limits,
    "scoreboard": _scoreboard,
}
#: Runs only when named: the packages of others have to be installed, or the page would lose them.
NAMED = {"scoreboard"}


def main() -> None:
    """Command line of the verification runs."""
    parser = argparse.ArgumentParser(prog="python -m verification", description=__doc__)
    parser.add_argument(
        "parts", nargs="*", metavar="part", help=f"of {', '.join(PARTS)}; all but the last by default"
    )
    parser.add_argument("--share", type=float, default=1.0, help="of the full number of records")
    parser.add_argument(
        "--only", default="", metavar="PATTERN", help="of the scenarios of fits, by their names"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--cache", type=Path, default=HERE / "cache", help="records already done are kept here"
    )
    given = parser.parse_args()
    unknown = set(given.parts) - set(PARTS)
    if unknown:
        parser.error(f"no part {', '.join(unknown)}; there are: {', '.join(PARTS)}")
    if given.only and given.parts != ["fits"]:
        parser.error("--only goes with the part fits")
    given.cache.mkdir(exist_ok=True)
    today = datetime.now(UTC).date().isoformat()
    order = Order(share=given.share, only=given.only, workers=given.workers, cache=given.cache, date=today)
    for name in given.parts or [part for part in PARTS if part not in NAMED]:
        PARTS[name](order)
    from verification.proof import draw

    draw(HERE / "results" / "proof.png")


if __name__ == "__main__":
    main()
