# SPDX-License-Identifier: BSD-3-Clause
"""The numbers and pictures of docs/explanation/what-the-data-can-tell.md.

Five questions to twins of the bench of the seed paper: what its filter is told and what it finds, how well any
estimator could do, what reading the curve costs, what a record without reversals holds, and what the verdicts say
when nothing, or something, is wrong. Everything is seeded; `python -m verification limits` takes two to four
minutes on two cores.

`quotes` gives the rows and phrases in which the page says the numbers; a test holds the page against them.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: one record per process, one thread each

import json
import math
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.experiments.earth_rate import EarthRateEstimate, measure_earth_rate
from allanite.experiments.reference_aided import ReferenceAided, reference_aided
from allanite.experiments.reversals import find_reversals
from allanite.filtering.regression import covariance_of
from allanite.filtering.simulation import simulate
from allanite.fitting.slopes import read_slopes
from allanite.noise import GaussMarkov, NoiseModel, Ramp, White
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.records import Recording
from allanite_seed_paper import twin as seed_paper

__all__ = ["quotes", "run"]

Json = dict[str, Any]
Array = NDArray[np.float64]

SEED = 20261121
ONE = 1  # seed of the single records
HERE = Path(__file__).parent
RESULT = HERE / "results" / "what_the_data_can_tell.json"
PICTURES = HERE.parent / "docs" / "images"

DEG = math.pi / 180
DEG_H = DEG / 3600
SEEN = math.cos(seed_paper.LATITUDE)
"""Part of the Earth's rotation that a level axis to the north sees at the bench."""

LENGTHS = {"60 s": 60.0, "12 min": 720.0, "25 min": 1500.0, "60 min": 3600.0, "120 min": 7200.0}
REFERENCES = (0.004178, 0.008356, -0.004178)  # deg/s, typed into the filter
TAKES = {
    "2": seed_paper.TAKES[2],
    "3": seed_paper.TAKES[3],
    "4": seed_paper.TAKES[4],
    "4, last 13 min": seed_paper.TAKE_4_END,
    "1": seed_paper.TAKES[1],
}
WEEKS = 30
RECORDS = 400  # with nothing wrong; half as many of each fault
TIMES = {
    "30 s": 30.0,
    "60 s": 60.0,
    "10 min": 600.0,
}  # at which the filter's answer is looked at in many records
NEAR = 0.1  # of the reference: read as "converged"
NUMBER_OF_INTERVALS = 100


def run(workers: int = 2) -> tuple[Json, Json]:
    """All numbers, and the series that the pictures need besides."""
    told, course = circular()
    told["scatter"], course["scatter"] = scatter(workers)
    document: Json = {
        "date": datetime.now(UTC).date().isoformat(),
        "seed": SEED,
        "seed_of_single_records": ONE,
        "earth_rate_deg_s": EARTH_RATE / DEG,
        "latitude_deg": seed_paper.LATITUDE / DEG,
        "circular": told,
        "bound": bounds(),
        "takes": published_takes(),
        "minimum": minima(),
        "slopes": slopes(workers),
        "at_rest": at_rest(),
    }
    document["faults"], intervals = faults(workers)
    return document, {**course, "intervals": intervals, "curves": curves()}


# -- one: the circular reference --------------------------------------------------------------------------


def circular() -> tuple[Json, Json]:
    """One record, several references, both readings; the same record without the Earth; the share of the reference."""
    take = _take(seed_paper.sensor(), LENGTHS["120 min"], ONE)
    blind = _take(seed_paper.sensor(), LENGTHS["120 min"], ONE, latitude=None)
    rows, series = [], {}
    for reference in REFERENCES:
        plain, none, signed = (
            _unsigned(take, reference),
            _unsigned(blind, reference),
            _demodulated(take, reference),
        )
        rows.append(
            {
                "reference": reference,
                "unsigned": plain.mean_corrected / DEG,
                "unsigned_without_earth": none.mean_corrected / DEG,
                "demodulated": signed.mean_corrected / SEEN / DEG,
            }
        )
        series[reference] = tuple(
            _thinned(a.cumulative_corrected / DEG / part)
            for a, part in ((plain, 1.0), (none, 1.0), (signed, SEEN))
        )
    pairs = _measure(take)
    shares = [
        {
            "length": name,
            "unsigned": _unsigned(take.window(0, length), REFERENCES[0]).follows,
            "demodulated": _demodulated(take.window(0, length), REFERENCES[0]).follows,
        }
        for name, length in LENGTHS.items()
    ]
    reading = pairs.reading("pairs")
    assert reading is not None
    told = {
        "rows": rows,
        "pairs": reading.rate / DEG,
        "regression": pairs.rate / DEG,
        "sd": pairs.sd / DEG,
        "shares": shares,
        "first_order": _first_order(take),
    }
    return told, {"circular": series}


def _first_order(take: Recording) -> float:
    """Largest relative change of an answer when the paper's Q_d, of first order in Ts/T_b, is made exact."""
    changes = []
    for length in LENGTHS.values():
        for read in (_unsigned, _demodulated):
            record = take.window(0, length)
            paper, exact = (read(record, REFERENCES[0], exact=e).mean_corrected for e in (False, True))
            changes.append(abs(exact / paper - 1))
    return max(changes)


def scatter(workers: int) -> tuple[Json, Json]:
    """What both readings give in many takes with nothing wrong, without and with a turn-on bias; of the reference."""
    jobs = [(turned_on, k) for turned_on in (False, True) for k in range(RECORDS)]
    with Pool(workers) as pool:
        found = np.array(pool.map(_answers, jobs, chunksize=8)).reshape(2, RECORDS, 2, -1)
    at = [round(time * seed_paper.RATE) - 1 for time in TIMES.values()]
    rows, course = [], _shown(TIMES["10 min"])
    for j, name in enumerate(TIMES):
        row: Json = {"time": name}
        for reading, values in _by_reading(found[..., -len(at) + j]).items():
            row[reading] = {
                "mean": float(values.mean()),
                "sd": float(values.std(ddof=1)),
                "near": float(np.mean(np.abs(values - 1) <= NEAR)),
            }
        rows.append(row)
    facts = {"records": RECORDS, "near": NEAR, "turn_on_sd_deg_s": seed_paper.TURN_ON_SD / DEG}
    spread = {reading: values.std(axis=0, ddof=1) for reading, values in _by_reading(found).items()}
    return {**facts, "rows": rows}, {
        "time": (course + 1) / seed_paper.RATE,
        **{reading: sd[: len(course)] for reading, sd in spread.items()},
    }


def _by_reading(found: Array) -> dict[str, Array]:
    """By what the answers were read; first axis without and with a turn-on bias, then records, then readings."""
    return {
        f"{reading}{bias}": found[b, :, r]
        for r, reading in enumerate(("unsigned", "demodulated"))
        for b, bias in enumerate(("", "_turn_on"))
    }


def _answers(job: tuple[bool, int]) -> list[list[float]]:
    """Both cumulative means of one take over the reference: for the picture, and at `TIMES`."""
    turned_on, number = job
    size = seed_paper.TURN_ON_SD * float(np.random.default_rng([SEED, number]).standard_normal())
    seed = SEED + 10_000 + number
    effects = {"turn_on_bias": size} if turned_on else {}
    record = _take(seed_paper.sensor(), TIMES["10 min"], seed, effects=effects)
    at = [round(time * seed_paper.RATE) - 1 for time in TIMES.values()]
    rows = np.concatenate([_shown(TIMES["10 min"]), at])
    told = REFERENCES[0] * DEG
    return [
        (read(record, REFERENCES[0]).cumulative_corrected[rows] / part / told).tolist()
        for read, part in ((_unsigned, 1.0), (_demodulated, SEEN))
    ]


def _shown(duration: float) -> NDArray[np.int64]:
    """Rows of a picture."""
    return np.unique(np.geomspace(128, duration * seed_paper.RATE, 60).astype(np.int64)) - 1


def _measure(record: Recording) -> EarthRateEstimate:
    """What allanite says when it is told the true noise of the sensor at rest and the first direction, no more."""
    return measure_earth_rate(record, latitude=seed_paper.LATITUDE, model=seed_paper.sensor(), first="north")


def _unsigned(record: Recording, reference: float, **options: Any) -> ReferenceAided:
    """As Figs 10 to 13 of the paper are described: one reference, no heading, the turns cut out."""
    values = record.values(record.names[0]).copy()
    values[find_reversals(record, first="north").signs() == 0] = np.nan
    still = Recording.from_rate(values, rate=record.rate, unit="deg/s", names=record.names)
    return reference_aided(still, seed_paper.sensor(), reference=reference * DEG, **options)


def _demodulated(record: Recording, reference: float, **options: Any) -> ReferenceAided:
    """Reference and samples with the sign of the heading; the axis sees cos(latitude) of the reference."""
    signs = find_reversals(record, first="north").signs()
    told = reference * DEG * SEEN
    return reference_aided(record, seed_paper.sensor(), reference=told, signs=signs, **options)


# -- two: the bound ---------------------------------------------------------------------------------------


def bounds() -> list[Json]:
    """The best possible sd(Omega)/Omega: 30 s dwells, no time lost in turning, every sample used."""
    models = _models()
    return [{"length": n, **{k: bound(m, t) for k, m in models.items()}} for n, t in LENGTHS.items()]


def bound(model: NoiseModel, length: float, lost: float = 0.0) -> float:
    """Of one noise model and one length; `lost` seconds after the beginning of each turn are not used."""
    dt = 1 / seed_paper.RATE
    time = (np.arange(round(length / dt)) + 0.5) * dt
    sign = np.where(time // seed_paper.DWELL % 2 == 0, 1.0, -1.0)
    used = np.where((time % seed_paper.DWELL < lost) & (time > seed_paper.DWELL), 0.0, 1.0)
    columns = np.column_stack([sign * SEEN, np.ones_like(sign)])
    return math.sqrt(covariance_of(columns, model, dt=dt, counts=used)[0, 0]) / EARTH_RATE


def _models() -> dict[str, NoiseModel]:
    return {
        "published": seed_paper.sensor(),
        "white": NoiseModel.of(White(N=seed_paper.N)),
        "flicker": seed_paper.sensor(flicker=True),
    }


def published_takes() -> Json:
    """The results of the paper against truth and bound, and the one error that would explain each."""
    rows = []
    for name, take in TAKES.items():
        sd, error = bound(seed_paper.sensor(), take.duration) * EARTH_RATE, take.published - EARTH_RATE
        along = abs(error) * SEEN  # what the axis must have seen wrong
        rows.append(
            {
                "take": name,
                "length": take.duration,
                "published": take.published / DEG,
                "sd": sd / DEG,
                "off": abs(error) / sd,
                "drift_deg_s_h": 2 * along / seed_paper.DWELL * 3600 / DEG,
                "rotation_deg": along * seed_paper.DWELL / DEG,
                "coherent_deg_s": along / DEG,
                "pointing_deg": math.degrees(math.acos(np.clip(take.published / EARTH_RATE, -1, 1))),
            }
        )
    sensor, hour = seed_paper.sensor(), LENGTHS["60 min"]
    lost = {f"lost_{n}_s": bound(sensor, hour, n) / bound(sensor, hour) - 1 for n in (2, 3)}
    return {"rows": rows, "pointing_5_deg": 1 - math.cos(5 * DEG), **lost}


# -- three: reading the curve -----------------------------------------------------------------------------


def minima() -> Json:
    """Where the published model has the minimum of its curve, under both families."""
    tau, found = np.geomspace(1.0, 1e4, 40001), {}
    for name in ("published", "flicker"):
        at = float(tau[np.argmin(_models()[name].avar(tau))])
        found[name] = {"tau": at, "T_b": at / 1.89}
    return {**found, "expected": 1.89 * seed_paper.T_B}


def curves() -> dict[str, tuple[Array, Array]]:
    """Allan deviation of the published model and of its parts [deg/s]."""
    tau = np.geomspace(0.1, 1e5, 600)
    models = {k: m for k, m in _models().items() if k != "white"}
    parts = {f"part {i}": NoiseModel.of(t) for i, t in enumerate(seed_paper.sensor().terms)}
    return {k: (tau, np.sqrt(m.avar(tau)) / DEG) for k, m in {**models, **parts}.items()}


def slopes(workers: int) -> Json:
    """Relative errors of both readings over simulated weeks, with the best that a week allows."""
    with Pool(workers) as pool:
        found = np.array(pool.map(_week, range(WEEKS), chunksize=1))
    scenarios = json.loads((HERE / "results" / "coverage.json").read_text())["scenarios"]
    week = next(s for s in scenarios if s["name"] == "seed's sensor, 7 days")
    best = {p["symbol"]: p["bound"] for p in week["parameters"]}
    out: Json = {"weeks": WEEKS}
    for i, (name, symbol) in enumerate({"T_b": "T", "B": "B_equiv", "K": "K"}.items()):
        out[name] = {"bound": best[symbol]}
        for j, how in enumerate(("slopes", "fit")):
            errors = found[:, j, i]
            out[name][how] = {
                "mean": float(errors.mean()),
                "sd": float(errors.std(ddof=1)),
                "errors": [round(float(e), 5) for e in errors],
            }
    return out


def _week(number: int) -> list[list[float]]:
    """Relative errors of T_b, B and K by slopes and by the fit, in one week.

    The week is made as means over 1 s, which are those over 32 samples at 32 Hz; the curve that is read has 40 lags
    per decade, so that the grid decides nothing.
    """
    record = simulate(seed_paper.sensor(), rate=1.0, duration=seed_paper.WEEK, seed=SEED + number)
    fine = read_slopes(al.allan_curve(record, taus=40))
    read = [_value(fine, s) for s in ("T", "B", "K")]
    model = al.fit(al.allan_curve(record))
    bias = next(t for t in model.terms if isinstance(t, GaussMarkov))
    fitted = [bias.T, bias.B_equiv, _value(model, "K")]
    truth = (seed_paper.T_B, seed_paper.B, seed_paper.K)
    return [[v / t - 1 for v, t in zip(values, truth, strict=True)] for values in (read, fitted)]


def _value(model: al.NoiseModel, symbol: str) -> float:
    estimate = model.estimate(symbol)
    assert estimate is not None
    assert estimate.value is not None
    return estimate.value


# -- four: without reversals ------------------------------------------------------------------------------


def at_rest() -> Json:
    """What the tool says of a record in which nothing was turned."""
    record = simulate(
        seed_paper.sensor(),
        rate=seed_paper.RATE,
        duration=LENGTHS["25 min"],
        seed=ONE,
        unit="deg/s",
        motion=al.Motion.still(),
        latitude=seed_paper.LATITUDE,
        turn_on_bias=0.02 * DEG,
    )
    found = _measure(record)
    return {"verdict": found.verdict, "reason": found.reason, "bias_true_deg_h": 0.02 * 3600}


# -- five: what the verdicts say --------------------------------------------------------------------------

#: Motion and effects of each kind of record; all of 25 min, dwells of 30 s, 2 s left out after each turn.
CASES: dict[str, Json] = {
    "nothing": {},
    "a rotation of 0.12° left after each turn": {"faults": ("settling",)},
    "a drift of 0.96 deg/s per hour": {"faults": ("drift",)},
    "a pointing error (standard deviation 5°), another in each dwell": {"pointing_sd": 5 * DEG},
    "a turn that was missed": {"missed": (20,)},
    "a bias that follows the turns, −0.0034 deg/s": {"coherent_bias": -0.0034 * DEG},
    "the same, +0.0034 deg/s": {"coherent_bias": 0.0034 * DEG},
    "the same, +0.0005 deg/s": {"coherent_bias": 0.0005 * DEG},
}
VERDICTS = ("resolved", "not resolved", "inconsistent", "inconsistent with Earth")


def faults(workers: int) -> tuple[list[Json], Array]:
    """Verdicts by case; and some intervals of records with nothing wrong, in deg/s."""
    counts = {name: RECORDS if name == "nothing" else RECORDS // 2 for name in CASES}
    jobs = [(name, k) for name, n in counts.items() for k in range(n)]
    with Pool(workers) as pool:
        found = pool.map(_measured, jobs, chunksize=8)
    rows = []
    for name, n in counts.items():
        own = [r for (case, _), r in zip(jobs, found, strict=True) if case == name]
        verdicts = Counter(r["verdict"] for r in own)
        rows.append(
            {
                "case": name,
                "records": n,
                "verdicts": {v: verdicts[v] / n for v in VERDICTS},
                "checks_failed": sum(r["failed"] for r in own) / n,
                "mean": float(np.mean([r["rate"] for r in own])),
                "inside": sum(r["inside"] for r in own) / n,
                "wrong": sum(r["wrong"] for r in own) / n,
                "wrong_without_earth": sum(r["wrong_without_earth"] for r in own) / n,
                "sd": float(np.sqrt(np.mean([r["sd"] ** 2 for r in own]))),
            }
        )
    intervals = [(r["rate"], *r["interval"]) for r in found[:NUMBER_OF_INTERVALS]]
    return rows, np.array(intervals)


def _measured(job: tuple[str, int]) -> Json:
    name, number = job
    options = dict(CASES[name])
    kinds = options.pop("faults", ())
    model = seed_paper.sensor()
    made = model + Ramp(R=seed_paper.DRIFT) if "drift" in kinds else model
    record = _take(made, LENGTHS["25 min"], SEED + 1 + number, faults=kinds, **options)
    e = _measure(record)
    alone = e.verdict in ("resolved", "inconsistent with Earth")  # "resolved", but for the known rate
    return {
        "verdict": e.verdict,
        "rate": e.rate / DEG,
        "sd": e.sd / DEG,
        "interval": [v / DEG for v in e.interval],
        "inside": bool(e.interval[0] <= EARTH_RATE <= e.interval[1]),
        "failed": any(not c.passed for c in e.checks),
        "wrong": bool(abs(e.deviation) > 3 and e.verdict == "resolved"),
        "wrong_without_earth": bool(abs(e.deviation) > 3 and alone),
    }


def _take(
    model: NoiseModel,
    duration: float,
    seed: int,
    *,
    latitude: float | None = seed_paper.LATITUDE,
    faults: tuple[str, ...] = (),
    effects: Json | None = None,
    **options: Any,
) -> Recording:
    """A take of the bench; without a latitude nothing rotates but the hand that turns.

    `effects` are those of `simulate`, `options` those of the motion.
    """
    motion = seed_paper.take_motion(faults=faults, **options)
    return simulate(
        model,
        rate=seed_paper.RATE,
        duration=duration,
        seed=seed,
        unit="deg/s",
        motion=motion,
        latitude=latitude,
        **(effects or {}),
    )


def _thinned(values: Array, points: int = 500) -> tuple[Array, Array]:
    """A series at even steps of the logarithm of time [s], from a tenth of a second on."""
    rows = np.unique(np.geomspace(4, len(values), points).astype(int)) - 1
    return (rows + 1) / seed_paper.RATE, np.asarray(values[rows])


# -- the page ---------------------------------------------------------------------------------------------


def quotes(document: Json) -> list[str]:
    """Rows and phrases that the page must contain."""
    parts: tuple[Callable[[Json], list[str]], ...] = (_say_circular, _say_bound, _say_slopes, _say_verdicts)
    return [text for part in parts for text in part(document)]


def _say_circular(d: Json) -> list[str]:
    told = d["circular"]
    rows = [
        f"| {_minus(r['reference'], 6)} | {_minus(r['unsigned'])} | {_minus(r['unsigned_without_earth'])} | "
        f"{_minus(r['demodulated'])} |"
        for r in told["rows"]
    ]
    shares = [f"| {s['length']} | {s['unsigned']:.4f} | {s['demodulated']:.2f} |" for s in told["shares"]]
    first, second = (told["rows"][i]["demodulated"] for i in (0, 1))
    passed = (1 - told["shares"][0]["unsigned"]) * told["scatter"]["turn_on_sd_deg_s"]
    less = REFERENCES[0] - told["rows"][0]["unsigned"]
    return [
        *rows,
        *shares,
        *_say_scatter(told["scatter"]),
        f"less {less:.5f} deg/s",
        f"leaves {passed:.4f} deg/s of it, {100 * passed / REFERENCES[0]:.0f} % of the reference",
        f"by {100 * (second / first - 1):.0f} %",
        f"pairs give {told['pairs']:.4f} deg/s",
        f"{told['regression']:.4f} ± {told['sd']:.4f} deg/s",
        f"the reference still has the weight {told['shares'][0]['demodulated']:.2f}",
        f"by less than {math.ceil(1e6 * told['first_order'])} parts in a million",
    ]


def _say_scatter(d: Json) -> list[str]:
    def cell(x: Json) -> str:
        return f"{100 * x['mean']:.0f} ± {100 * x['sd']:.0f} %"

    readings = ("unsigned", "unsigned_turn_on", "demodulated", "demodulated_turn_on")
    near = d["rows"][1]["unsigned"]["near"]
    return [
        *(f"| {r['time']} | {' | '.join(cell(r[name]) for name in readings)} |" for r in d["rows"]),
        f"{d['records']} takes with nothing wrong",
        f"a standard deviation of {d['turn_on_sd_deg_s']:g} deg/s",
        f"within {100 * d['near']:.0f} % of the reference after 60 s in {100 * near:.0f} % of the takes",
        f"in all four of four takes with a probability of {100 * near**4:.1f} %",
    ]


def _say_bound(d: Json) -> list[str]:
    rows = d["bound"]
    cells = {
        "noise as published": [_percent(r["published"]) for r in rows],
        "white noise alone": [_percent(r["white"]) for r in rows],
        "same floor, true 1/f flicker": [_percent(r["flicker"]) for r in rows],
    }
    takes = d["takes"]
    table = [
        f"| {r['take']} | {r['length'] / 60:g} min | {_minus(r['published'], 6)} | {r['sd']:.5f} | {r['off']:.1f} | "
        + ("– | – | – |" if r["take"] == "1" else f"{_error_cells(r)} |")
        for r in takes["rows"]
    ]
    pointing = next(r for r in takes["rows"] if r["take"] == "2")["pointing_deg"]
    return [
        *(f"| {name} | {' | '.join(row)} |" for name, row in cells.items()),
        *table,
        f"to {_percent(rows[0]['published'])} at best, after two hours to {_percent(rows[-1]['published'])}",
        f"only {1 / rows[0]['published']:.1f} standard deviations from zero",
        f"Two seconds lost at each turn add {100 * takes['lost_2_s']:.1f} %, three {100 * takes['lost_3_s']:.1f} %",
        f"5° costs {100 * takes['pointing_5_deg']:.1f} %",
        f"needs {pointing:.0f}°",
    ]


def _error_cells(r: Json) -> str:
    return f"{r['drift_deg_s_h']:.2f} | {r['rotation_deg']:.3f} | {r['coherent_deg_s']:.4f}"


def _say_slopes(d: Json) -> list[str]:
    def cell(x: Json) -> str:
        return f"{_signed(100 * x['mean'])} ± {100 * x['sd']:.0f} %"

    m, s = d["minimum"], d["slopes"]
    return [
        *(
            f"| {name} | {cell(s[name]['slopes'])} | {cell(s[name]['fit'])} | {100 * s[name]['bound']:.1f} % |"
            for name in ("T_b", "B", "K")
        ),
        f"at {m['published']['tau']:.0f} s under the paper's own Gauss-Markov model",
        f"T_b = {m['published']['T_b']:.1f} s",
        f"at {m['flicker']['tau']:.0f} s under true flicker",
        f"1.89 T_b = {m['expected']:.0f} s",
        f"{-100 * s['T_b']['slopes']['mean']:.0f} % too small",
        f"Over {s['weeks']} simulated weeks",
        f"> {d['at_rest']['verdict']}: {d['at_rest']['reason']}",
    ]


def _say_verdicts(d: Json) -> list[str]:
    rows = [
        f"| {r['case']} | {r['mean']:.4f} | "
        + " | ".join(f"{100 * r['verdicts'][v]:.3g} %" for v in VERDICTS)
        + f" | {100 * r['wrong_without_earth']:.3g} % |"
        for r in d["faults"]
    ]
    assert not any(r["wrong"] for r in d["faults"])  # by construction, as the page says
    honest, coherent = d["faults"][0], d["faults"][-3:]
    silent = sum(r["checks_failed"] for r in coherent) / len(coherent)
    return [
        *rows,
        f"{honest['records']} records with nothing wrong and {d['faults'][1]['records']} of each other kind",
        f"In {100 * honest['inside']:.3g} % of {honest['records']} records with nothing wrong",
        f"standard deviation of {honest['sd']:.5f} deg/s",
        (
            f"fails in {100 * silent:.3g} % of the records with a bias that follows the turns, and in "
            f"{100 * honest['checks_failed']:.3g} % of those with nothing wrong"
        ),
    ]


def _percent(x: float) -> str:
    return f"{100 * x:.0f} %" if x >= 0.2 else f"{100 * x:.1f} %"


def _minus(x: float, digits: int = 4) -> str:
    return f"{x:.{digits}f}".replace("-", "−")


def _signed(x: float) -> str:
    return f"{x:+.0f}".replace("-", "−").replace("+0", "0").replace("−0", "0")


def main() -> None:
    """Write the numbers and the pictures, and say what the page has to say."""
    from verification.what_the_data_can_tell_pictures import draw

    document, series = run()
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    PICTURES.mkdir(exist_ok=True)
    draw(document, series, PICTURES)
    print("\n".join(quotes(document)))


if __name__ == "__main__":
    main()
