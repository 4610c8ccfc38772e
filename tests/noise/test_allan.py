# SPDX-License-Identifier: BSD-3-Clause
"""The Allan curve: published tables, exact arithmetic, Stable32's results, exact relations, and refusals."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import DataQualityError, FormatError, InputError, LimitError, StorageError
from allanite.noise import White
from allanite.noise.allan.degrees import chi_square_factors, edf_greenhall, edf_total
from allanite.noise.allan.statistics import STATISTICS
from allanite.recording.records import Recording

PUBLISHED = Path(__file__).parents[1] / "published" / "sp1065.csv"
TEN = [892, 809, 823, 798, 671, 644, 883, 903, 677]


def thousand() -> list[int]:
    n = [1234567890]
    for _ in range(999):
        n.append(16807 * n[-1] % 2147483647)
    return n


def record(y: object, rate: float = 1.0) -> Recording:
    return Recording.from_rate(np.asarray(y), rate=rate, unit="rad/s", sampling="point")


def oadev(y: object, taus: object = "octave", **options: object) -> al.AllanCurve:
    return al.allan_curve(record(y), taus=taus, **options)  # type: ignore[arg-type]


def _table() -> list[dict[str, str]]:
    lines = [line for line in PUBLISHED.read_text().splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines))


# -- published values ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("statistic", sorted({row["statistic"] for row in _table()}))
def test_r1_nbs_ten_points_and_r2_thousand_points(statistic: str) -> None:
    samples = {"10": np.array(TEN, dtype=float), "1000": np.array(thousand()) / 2147483647}
    rows = [r for r in _table() if r["statistic"] == statistic]
    for name, y in samples.items():
        wanted = {int(r["m"]): float(r["value"]) for r in rows if r["set"] == name}
        curve = al.allan_curve(record(y), statistic=statistic, taus=[float(m) for m in wanted])
        np.testing.assert_allclose(curve.deviation[:, 0], list(wanted.values()), rtol=1e-9)
    assert len(rows) == 5


def test_r2_terms_of_the_thousand_points() -> None:
    y = np.array(thousand()) / 2147483647
    terms = {"adev": [999, 99, 9], "oadev": [999, 981, 801], "mdev": [999, 972, 702], "hdev": [998, 98, 8],
             "ohdev": [998, 971, 701], "totdev": [999, 999, 999]}  # fmt: skip
    for statistic, count in terms.items():
        curve = al.allan_curve(record(y), statistic=statistic, taus=[1.0, 10.0, 100.0])
        np.testing.assert_array_equal(curve.count[:, 0], count)
    assert np.std(y, ddof=1) == pytest.approx(0.2884664, rel=5e-7)


def test_r5_numacc4_cancellation() -> None:
    """Exactly as the decimal input says, to the input's own rounding."""
    y = np.array([10000000.2, *([10000000.1, 10000000.3] * 500)])
    curve = oadev(y, taus=[1.0, 2.0, 3.0])
    exact = [3997 / 200000, 1 / 798400, 1327 / 597600]
    np.testing.assert_allclose(curve.variance[:, 0], exact, rtol=5e-8)


def _rational_oavar(y: list[int], m: int) -> Fraction:
    x = [0]
    for value in y:
        x.append(x[-1] + value)
    d = [x[i + 2 * m] - 2 * x[i + m] + x[i] for i in range(len(y) - 2 * m + 1)]
    return Fraction(sum(v * v for v in d), 2 * m * m * len(d))


@pytest.mark.long
def test_r10_two_hundred_integer_vectors_in_rational_arithmetic() -> None:
    rng = np.random.default_rng(10)
    for _ in range(200):
        y = rng.integers(-1000, 1000, size=int(rng.integers(3, 121))).tolist()
        lags = np.arange(1, len(y) // 2 + 1)
        curve = oadev(np.array(y), taus=lags.astype(float))
        exact = [math.sqrt(_rational_oavar(y, int(m))) for m in lags]
        np.testing.assert_allclose(curve.deviation[:, 0], exact, rtol=1e-13, atol=1e-12)


@pytest.mark.parametrize("statistic", ["adev", "oadev", "mdev", "hdev", "ohdev", "totdev"])
def test_r13_an_independent_package(statistic: str) -> None:
    allantools = pytest.importorskip("allantools")
    y = np.random.default_rng(13).standard_normal(20_000)
    lags = [1.0, 3.0, 16.0, 200.0, 2000.0]
    _, expected, _, n = getattr(allantools, statistic)(y, rate=1.0, data_type="freq", taus=lags)
    curve = al.allan_curve(record(y), statistic=statistic, taus=lags)
    np.testing.assert_allclose(curve.deviation[:, 0], expected, rtol=1e-11)
    np.testing.assert_array_equal(curve.count[:, 0], n)


# -- Stable32 -----------------------------------------------------------------------------------------------------

_FILES = [
    (
        "phasedat",
        "PHASE.DAT",
        "phase_dat_{}_octave.txt",
        ("adev", "hdev", "mdev", "oadev", "ohdev", "tdev", "totdev"),
    ),
    ("Cs5071A", "5071A_phase.txt.gz", "{}_decade.txt", ("adev", "hdev", "mdev", "oadev", "ohdev", "tdev")),
    (
        "gps",
        "gps_1pps_phase_data.txt.gz",
        "stable32_{}_octave.txt",
        ("HDEV", "MDEV", "OADEV", "OHDEV", "TDEV"),
    ),
    (
        "ocxo",
        "ocxo_frequency.txt",
        "stable32_{}_alltau.txt",
        ("adev", "hdev", "mdev", "oadev", "ohdev", "tdev"),
    ),
    ("pink_frequency", "pink_frequency.txt", "{}.txt", ("adev", "hdev", "mdev", "oadev", "ohdev", "tdev")),
    ("pink_frequency", "pink_frequency.txt", "s32_{}_octave.txt", ("oadev",)),
    (
        "Keysight53230A_ti_noise_floor",
        "tic_phase.txt",
        "tic_{}.txt",
        ("hdev", "mdev", "oadev", "ohdev", "tdev"),
    ),
]


def _stable32(path: Path) -> tuple[np.ndarray, float]:
    confidence = next(
        float(t.split("=")[1]) for t in path.read_text(errors="replace").splitlines() if "Confidence" in t
    )
    return np.atleast_2d(np.genfromtxt(path)), confidence


@pytest.mark.parametrize(
    ("folder", "data", "pattern", "statistics"), _FILES, ids=[f"{f[0]}-{f[2]}" for f in _FILES]
)
def test_r3_r4_stable32(
    real_data: Callable[[str], Path], folder: str, data: str, pattern: str, statistics: tuple[str, ...]
) -> None:
    """Deviations to the printed digits, counts equal, intervals with the degrees of freedom of its convention."""
    samples = np.loadtxt(real_data(f"allantools_stable32/{folder}/{data}"))
    if folder == "ocxo":
        samples = samples / 1e7 - 1
    phase = folder not in ("ocxo", "pink_frequency")
    make = Recording.from_angle if phase else Recording.from_rate
    compared = 0
    for name in statistics:
        table, confidence = _stable32(real_data(f"allantools_stable32/{folder}/{pattern.format(name)}"))
        table = table[:: max(1, len(table) // 40)]
        statistic = STATISTICS[name.lower()]
        rec = make(
            samples, rate=table[0, 0] / table[0, 1], unit="rad" if phase else "rad/s"
        )  # one file has tau0 = 42 s
        curve = al.allan_curve(rec, statistic=statistic.name, taus=table[:, 0] * rec.dt)
        np.testing.assert_allclose(curve.deviation[:, 0], table[:, 5], rtol=1e-4)
        np.testing.assert_array_equal(curve.count[:, 0], table[:, 2])
        for row, value in zip(table, curve.deviation[:, 0], strict=True):
            if not row[4] > 0:  # some files were written without bounds
                continue
            low, high = _stable32_bounds(statistic, row, curve.n_samples, confidence)
            # for alpha = 1 the original approximates its sums by b0 + b1 ln m; ours are taken exactly
            rtol = 2e-3 if row[3] == 1 else 1e-3
            np.testing.assert_allclose([value * low, value * high], [row[4], row[6]], rtol=rtol)
            compared += 1
    assert compared > 0 or "alltau" in pattern or pattern == "{}.txt"  # written without bounds


def _stable32_bounds(statistic: object, row: np.ndarray, n: int, confidence: float) -> tuple[float, float]:
    m, alpha = int(row[0]), int(row[3])
    if statistic.total:  # type: ignore[attr-defined]
        edf = edf_total(alpha, n + 1, m)
    else:
        edf = edf_greenhall(
            alpha,
            statistic.order,  # type: ignore[attr-defined]
            m,
            n + 1,
            overlapping=statistic.overlapping,  # type: ignore[attr-defined]
            modified=statistic.modified,  # type: ignore[attr-defined]
        )
    low, high = chi_square_factors(np.array([edf]), confidence)
    return float(low[0]), float(high[0])


@pytest.mark.parametrize("alpha, expected", [(2, 150.0), (0, 150.0), (-1, 116.78), (-2, 92.64), (-4, 92.64)])
def test_degrees_of_freedom_of_the_total_deviation(alpha: int, expected: float) -> None:
    """b n/m - c with the constants of SP 1065, table 7; other noise counts as the nearest one there."""
    assert edf_total(alpha, 1000, 10) == pytest.approx(expected, rel=1e-12)


def test_greenhall_degrees_of_freedom() -> None:
    """Published values, white rate noise, 1001 phase points."""
    for order, overlapping, modified, m, expected in (
        (2, True, False, 1, 782.030),
        (2, True, False, 10, 135.071),
        (2, True, False, 100, 12.815),
        (2, False, False, 10, 66.988),
        (2, True, True, 10, 94.634),
        (2, True, True, 100, 7.417),
        (3, True, False, 1, 608.549),
        (3, True, False, 10, 113.699),
        (3, True, False, 100, 9.923),
    ):
        got = edf_greenhall(0, order, m, 1001, overlapping=overlapping, modified=modified)
        assert got == pytest.approx(
            expected, rel=5e-4
        )  # the published ones rest on coefficients of three digits


def test_table_32_interval() -> None:
    y = np.array(thousand()) / 2147483647
    value = oadev(y, taus=[10.0]).deviation[0, 0]
    low, high = chi_square_factors(np.array([146.176786]), 0.95)
    np.testing.assert_allclose([value * low[0], value * high[0]], [8.219488e-2, 1.034536e-1], rtol=1e-6)


# -- closed forms -------------------------------------------------------------------------------------------------


def test_c1_white_noise_has_slope_minus_one_half() -> None:
    y = np.random.default_rng(1).standard_normal(2_000_000)
    curve = oadev(y, taus=[float(10**k) for k in range(5)])
    error = (curve.variance[:, 0] * curve.lags - 1) / np.sqrt(2 / curve.edf[:, 0])
    assert np.all(np.abs(error) < 4)


def test_c6_ramp() -> None:
    y = 2e-3 * np.arange(10_000)
    curve = oadev(y, taus=[1.0, 7.0, 100.0, 3000.0])
    np.testing.assert_allclose(curve.variance[:, 0], (2e-3 * curve.tau) ** 2 / 2, rtol=1e-12)


def test_c11_white_density_is_two_sided() -> None:
    y = np.random.default_rng(11).standard_normal(400_000)
    curve = al.allan_curve(record(y, rate=100.0), taus=[0.01, 0.1, 1.0])
    np.testing.assert_allclose(curve.deviation[:, 0] * np.sqrt(curve.tau), 0.1, rtol=0.03)


# -- intervals ----------------------------------------------------------------------------------------------------


def test_u9_confidence_levels() -> None:
    y = np.random.default_rng(9).standard_normal(2000)
    narrow, wide = oadev(y, confidence=0.3), oadev(y, confidence=0.7)
    assert np.all(wide.lower < narrow.lower) and np.all(narrow.upper < wide.upper)
    for bad in (0, 1, 1.5, math.nan):
        with pytest.raises(InputError, match="confidence"):
            oadev(y, confidence=bad)


def test_u10_no_degrees_of_freedom_is_an_error_never_a_nan() -> None:
    for edf in (0.0, -3.0):
        with pytest.raises(DataQualityError, match="degrees of freedom"):
            chi_square_factors(np.array([edf]), 0.95)
    y = np.random.default_rng(9).standard_normal(100)
    with pytest.raises(InputError, match="longer than the record supports"):
        oadev(y, taus=[51.0])
    assert np.all(np.isfinite(oadev(y, taus=[50.0]).upper))
    with pytest.raises(DataQualityError):
        edf_greenhall(0, 2, 600, 1001, overlapping=True, modified=False)


def test_u11_factors_on_the_deviation() -> None:
    low, high = chi_square_factors(np.array([1.0, 10.0]), 0.95)
    np.testing.assert_allclose(
        [low[0], high[0], low[1], high[1]], [0.446149, 31.91016, 0.698717, 1.754934], rtol=1e-6
    )


def test_exact_intervals_under_a_model() -> None:
    y = np.random.default_rng(2).standard_normal(1024)
    curve = oadev(y).with_model(al.NoiseModel.of(White(N=1.0)))
    np.testing.assert_allclose(curve.edf[[0, 4, 8], 0], [682.2223, 93.3916, 4.0051], rtol=1e-5)
    assert "exact under" in curve.interval_basis
    assert "local power law" in oadev(y).interval_basis


# -- exact relations ----------------------------------------------------------------------------------------------


def test_m1_an_offset_changes_nothing() -> None:
    y = np.random.default_rng(1).standard_normal(5000)
    plain = oadev(y).deviation
    for c in (1.0, 2.5, 1e6):
        np.testing.assert_allclose(oadev(y + c).deviation, plain, rtol=1e-9)


def test_m3_reversal_and_negation() -> None:
    y = np.random.default_rng(3).standard_normal(5000)
    plain = oadev(y).deviation
    np.testing.assert_allclose(oadev(y[::-1]).deviation, plain, rtol=1e-11)
    np.testing.assert_array_equal(oadev(-y).deviation, plain)


def test_m4_time_unit() -> None:
    y = np.random.default_rng(4).standard_normal(4000)
    per_second = al.allan_curve(record(y, rate=2.0))
    per_minute = al.allan_curve(record(y, rate=120.0))
    np.testing.assert_allclose(per_second.tau, per_minute.tau * 60, rtol=1e-14)
    np.testing.assert_allclose(per_second.deviation, per_minute.deviation, rtol=1e-14)


def test_m5_parallelogram() -> None:
    a, b = np.random.default_rng(5).standard_normal((2, 3000))
    total = oadev(a + b).variance + oadev(a - b).variance
    np.testing.assert_allclose(total, 2 * oadev(a).variance + 2 * oadev(b).variance, rtol=1e-11)


def test_m6_a_turned_triad_keeps_its_sum() -> None:
    rng = np.random.default_rng(6)
    y = rng.standard_normal((3000, 3)) * [1.0, 2.0, 0.5]
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    before, after = oadev(y).variance.sum(axis=1), oadev(y @ turn.T).variance.sum(axis=1)
    np.testing.assert_allclose(after, before, rtol=1e-11)


def test_m7_haar_identity() -> None:
    K = 12
    y = np.random.default_rng(7).standard_normal(1 << K) + 3.0
    total = 0.0
    for k in range(K):
        total += _disjoint_avar(y, 1 << k)
    assert total == pytest.approx(2 * y.var(), rel=1e-12)


def _disjoint_avar(y: np.ndarray, m: int) -> float:
    """AVAR over disjoint pairs of blocks: our estimator on records of 2m samples each, averaged."""
    pairs = y.reshape(-1, 2 * m)
    if m > 64:
        return float(np.mean([oadev(p, taus=[float(m)]).variance[0, 0] for p in pairs]))
    holes = np.full((len(pairs), 2 * m + 1), np.nan)  # a gap after each pair leaves exactly one window in it
    holes[:, :-1] = pairs
    return float(oadev(holes.ravel(), taus=[float(m)]).variance[0, 0])


def test_m10_threads_do_not_change_a_digit() -> None:
    y = np.random.default_rng(10).standard_normal(300_000)
    y[1000:1100] = np.nan
    one = oadev(y, taus=20, threads=1)
    for threads in (2, 3, 16):
        np.testing.assert_array_equal(oadev(y, taus=20, threads=threads).deviation, one.deviation)


def test_the_decimated_engine_agrees_within_its_lost_degrees_of_freedom() -> None:
    y = np.random.default_rng(12).standard_normal(200_000)
    y[50_000:52_000] = np.nan
    exact, fast = oadev(y, engine="exact"), oadev(y, engine="decimated")
    np.testing.assert_allclose(fast.deviation[:7], exact.deviation[:7], rtol=1e-12)
    # what is left out of the sum is small against the estimate's own spread
    spread = np.sqrt(0.5 / exact.edf)
    assert np.all(np.abs(fast.deviation / exact.deviation - 1) < 0.35 * spread)


# -- missing samples and bad input ----------------------------------------------------------------------------------


def test_the_first_sample_may_be_missing() -> None:
    y = np.random.default_rng(0).standard_normal(1000)
    y[0] = np.nan
    np.testing.assert_allclose(
        oadev(y, taus=[1.0, 5.0]).deviation, oadev(y[1:], taus=[1.0, 5.0]).deviation, rtol=1e-12
    )


@pytest.mark.parametrize("statistic", ["adev", "oadev", "hdev", "ohdev", "mdev", "tdev"])
def test_only_complete_windows_count(statistic: str) -> None:
    """Twin: every window looked at by itself."""
    rng = np.random.default_rng(20)
    y = rng.standard_normal(400)
    y[[0, 57, 58, 200, 399]] = np.nan
    s = STATISTICS[statistic]
    for m in (1, 3, 10):
        squares = []
        for i in range(0, 400 - s.window(m) + 1, 1 if s.overlapping else m):
            w = y[i : i + s.window(m)]
            if not np.isnan(w).any():
                x = np.concatenate([[0], np.cumsum(w)])
                if s.modified:
                    squares.append(np.mean([x[j + 2 * m] - 2 * x[j + m] + x[j] for j in range(m)]) ** 2)
                else:
                    squares.append(np.diff(x[::m], n=s.order)[0] ** 2)
        expected = math.sqrt(np.mean(squares) / (s.norm * m * m)) * (m / math.sqrt(3) if s.time else 1)
        curve = al.allan_curve(record(y), statistic=statistic, taus=[float(m)])
        assert curve.count[0, 0] == len(squares)
        assert curve.deviation[0, 0] == pytest.approx(expected, rel=1e-11)


def test_totdev_refuses_gaps() -> None:
    y = np.ones(100)
    y[5] = np.nan
    with pytest.raises(InputError, match="oadev"):
        al.allan_curve(record(y), statistic="totdev")


@pytest.mark.parametrize("statistic", ["mdev", "tdev", "ohdev"])
def test_one_gap_costs_the_degrees_of_freedom_of_its_terms_only(
    statistic: str, rng: np.random.Generator
) -> None:
    y = rng.standard_normal(3000)
    holed = np.where(np.arange(3000) == 1, np.nan, y)
    whole, gap = (al.allan_curve(record(v), statistic=statistic, taus=[1, 100, 999]) for v in (y, holed))
    np.testing.assert_allclose(gap.edf[:2], whole.edf[:2] * gap.count[:2] / whole.count[:2], rtol=1e-9)
    assert np.all((gap.edf >= 1) & (gap.edf <= whole.edf))


@pytest.mark.parametrize("m", [1, 2, 4, 16])
def test_totdev_knows_no_more_than_oadev_at_short_lags(m: int, rng: np.random.Generator) -> None:
    total, overlapping = (
        al.allan_curve(record(rng.standard_normal(4096)), statistic=s, taus=[m]) for s in ("totdev", "oadev")
    )
    assert total.edf[0, 0] == pytest.approx(overlapping.edf[0, 0], rel=0.04)


@pytest.mark.parametrize(
    "change",
    [
        {"tau": [], "deviation": []},
        {"deviation": [1.0, math.nan]},
        {"tau": [math.nan, 2.0]},
        {"deviation": [-1.0, 1.0]},
        {"dt": 0.0},
        {"unit": "deg"},
    ],
)
def test_a_curve_from_elsewhere_must_be_one(change: dict[str, object]) -> None:
    given = {
        "tau": [1.0, 2.0],
        "deviation": [1.0, 0.7],
        "dt": 1.0,
        "n_samples": 1000,
        "unit": "deg/s",
    } | change
    with pytest.raises(InputError):
        al.AllanCurve.from_arrays(given.pop("tau"), given.pop("deviation"), **given)  # type: ignore[arg-type]


def test_a_long_lag_is_not_rounded_either() -> None:
    with pytest.raises(InputError, match="whole number"):
        al.allan_curve(record(np.zeros(3_000_000, dtype=np.int8), rate=1000.0), taus=[1000.0004])


def test_b1_one_nan_is_one_gap() -> None:
    y = np.random.default_rng(1).standard_normal(20_000)
    clean = oadev(y)
    y[777] = np.nan
    curve = oadev(y)
    assert int(np.diff(curve.missing[0], axis=1).sum()) == 1
    few = clean.lags <= 200
    np.testing.assert_allclose(curve.deviation[few], clean.deviation[few], rtol=0.01)
    # longer windows lose up to 2m of 20 000 terms: the change stays within the spread of what is lost
    share = 2 * clean.lags[~few, None] / 20_000
    assert np.all(
        np.abs(curve.deviation[~few] / clean.deviation[~few] - 1)
        < 4 * np.sqrt(share / clean.edf[~few]) + 0.01
    )


def test_b2_overload_words_are_never_samples() -> None:
    y = np.random.default_rng(2).standard_normal(20_000)
    spoiled = y.copy()
    where = [10, 500, 9_000, 12_000, 19_000]
    spoiled[where] = [np.inf, -np.inf, 9.9e37, 9.91e37, -1e38]
    y[where] = np.nan
    np.testing.assert_array_equal(oadev(spoiled).deviation, oadev(y).deviation)


def test_b3_nothing_to_work_on() -> None:
    with pytest.raises(DataQualityError, match="all 10 samples are missing"):
        oadev(np.full(10, np.nan))
    for n in (1, 2):
        with pytest.raises(DataQualityError, match=f"{n} samples?;.*at least 3"):
            oadev(np.ones(n))
    with pytest.raises((DataQualityError, InputError)):
        oadev(np.zeros(0))


@pytest.mark.filterwarnings("ignore::allanite.errors.DataQualityWarning")
def test_b4_a_constant_is_exactly_zero() -> None:
    assert np.all(oadev(np.full(100_000, 0.1)).deviation == 0.0)


@pytest.mark.parametrize("dtype", ["float16", "float32", "int16", "uint16", "int32", "int64"])
def test_b8_number_types_equal_rational_arithmetic(dtype: str) -> None:
    rng = np.random.default_rng(8)
    base = {"int64": (1 << 62) - 5000, "uint16": 65_000, "int16": -32_000}.get(dtype, 100)
    y = base + rng.integers(0, 500, size=300)
    samples = y.astype(dtype)
    exact = [math.sqrt(_rational_oavar([int(v) for v in samples.tolist()], m)) for m in (1, 4, 100)]
    np.testing.assert_allclose(oadev(samples, taus=[1.0, 4.0, 100.0]).deviation[:, 0], exact, rtol=1e-12)


def test_b10_shapes_and_types() -> None:
    y = np.random.default_rng(10).standard_normal(500)
    expected = oadev(y).deviation
    wide = np.zeros((500, 4))
    wide[:, 1] = y
    np.testing.assert_array_equal(oadev(wide[:, 1]).deviation, expected)  # not contiguous
    np.testing.assert_array_equal(oadev(y[::-1][::-1]).deviation, expected)  # negative strides
    y.flags.writeable = False
    np.testing.assert_array_equal(oadev(y).deviation, expected)
    masked = np.ma.masked_array(y, mask=np.arange(500) == 7)
    gap = al.allan_curve(Recording.from_rate(masked, rate=1.0, unit="rad/s"))
    assert gap.count[0, 0] == 499 - 2  # of 499 windows of two, two hold the masked sample
    for bad in (
        y > 0,
        y + 1j,
        y.astype(object),
        np.array(["1", "2"]),
        np.float64(3.0),
        np.zeros((3, 200)),
        np.zeros((2, 2, 2)),
    ):
        with pytest.raises(InputError, match=r"shape|dtype"):
            oadev(bad)


@pytest.mark.parametrize("rate", [0, -1, math.nan, math.inf, "100", True])
def test_b11_bad_rates(rate: object) -> None:
    with pytest.raises(InputError, match="rate must be"):
        Recording.from_rate([1.0, 2.0, 3.0], rate=rate, unit="rad/s")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("taus", "message"),
    [
        ([1.4], "not a whole number of samples"),
        ([1.6], "nearest is 2"),
        ([-1.0], "positive"),
        ([51.0], "longest is 50"),
        ([2.0, 2.0], "twice"),
        ([math.nan], "finite"),
        ([], "positive"),
        ("halves", "octave"),
        (0, "per decade"),
        (["a"], "numbers"),
    ],
)
def test_b11_bad_lags_are_refused_never_rounded(taus: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        oadev(np.arange(100.0) ** 2, taus=taus)


def test_taus_all_is_bounded() -> None:
    with pytest.raises(LimitError, match="per decade"):
        oadev(np.zeros(400_000), taus="all")


def test_grids() -> None:
    y = np.random.default_rng(0).standard_normal(3000)
    assert oadev(y).lags.tolist() == [1 << i for i in range(10)]
    assert oadev(y, taus="decade").lags.tolist() == [1, 2, 4, 10, 20, 40, 100, 200, 400, 1000]
    assert oadev(y, taus="all").lags.tolist() == list(range(1, 1001))
    assert len(oadev(y, taus=10).lags) > 20


def test_b15_a_hole_is_not_bridged() -> None:
    """White + walk, 40 000 of 200 000 samples missing: inside the band of the exact expectation; spliced: outside."""
    rng = np.random.default_rng(15)
    n, K = 200_000, 1e-2
    y = rng.standard_normal(n) + K * np.cumsum(rng.standard_normal(n))
    model = al.NoiseModel.of(White(N=1.0), al.noise.RandomWalk(K=K))
    holed = y.copy()
    holed[100_000:140_000] = np.nan
    curve = oadev(holed, taus=[float(m) for m in (1, 10, 100, 1000, 3000, 10_000)]).with_model(model)
    expected = model.avar_sampled(curve.lags, 1.0, "point")

    def inside(c: al.AllanCurve) -> np.ndarray:
        low, high = chi_square_factors(c.edf[:, 0], 0.999)
        return (c.variance[:, 0] * low**2 <= expected) & (expected <= c.variance[:, 0] * high**2)

    assert inside(curve).all()
    jump = np.concatenate([y[:100_000], y[140_000:] + 300 * K * 5])
    spliced = oadev(jump, taus=curve.tau).with_model(model)
    assert not inside(spliced).all()


# -- the object -----------------------------------------------------------------------------------------------------


def test_recorded_angles_give_the_curve_of_their_rates() -> None:
    y = np.random.default_rng(1).standard_normal(2000)
    theta = np.concatenate([[0], np.cumsum(y)]) / 50.0
    angles = al.allan_curve(Recording.from_angle(theta, rate=50.0, unit="rad"))
    rates = al.allan_curve(Recording.from_rate(y, rate=50.0, unit="rad/s"))
    np.testing.assert_allclose(angles.deviation, rates.deviation, rtol=1e-9)
    np.testing.assert_array_equal(angles.count, rates.count)


def test_units_scale_the_result_not_the_samples() -> None:
    y = np.random.default_rng(1).standard_normal(1000).astype(np.float32)
    degrees = al.allan_curve(Recording.from_rate(y, rate=10.0, unit="deg/s"))
    radians = al.allan_curve(Recording.from_rate(y, rate=10.0, unit="rad/s"))
    np.testing.assert_allclose(degrees.deviation, np.deg2rad(1.0) * radians.deviation, rtol=1e-14)


def test_a_sensor_read_in_volts() -> None:
    y = np.random.default_rng(1).standard_normal(1000)
    volts = al.allan_curve(
        Recording.from_rate(0.024 * y, rate=10.0, unit="V", scale_factor="24.0 mV/(deg/s)")
    )
    degrees = al.allan_curve(Recording.from_rate(y, rate=10.0, unit="deg/s"))
    np.testing.assert_allclose(volts.deviation, degrees.deviation, rtol=1e-12)


def test_csv_gives_back_the_curve(tmp_path: Path) -> None:
    y = np.random.default_rng(1).standard_normal((500, 2))
    y[20:30, 1] = np.nan
    curve = al.allan_curve(Recording.from_rate(y, rate=10.0, unit="deg/s", names=["x, left", "z"]))
    path = curve.to_csv(tmp_path / "allan.csv")
    again = al.AllanCurve.from_csv(path)
    for name in ("lags", "tau", "deviation", "lower", "upper", "edf", "count"):
        np.testing.assert_array_equal(getattr(again, name), getattr(curve, name))
    assert again.channels == curve.channels and again.dt == curve.dt and again.n_samples == 500
    np.testing.assert_array_equal(again.missing[1], [[20, 30]])
    with pytest.raises(StorageError, match="exists"):
        curve.to_csv(path)
    path.write_text("a,b\n1,2\n")
    with pytest.raises(FormatError, match="not a curve"):
        al.AllanCurve.from_csv(path)


def test_hostile_names_stay_one_cell_of_text_and_come_back(tmp_path: Path) -> None:
    y = np.random.default_rng(1).standard_normal((100, 2))
    names = ["=1+1", "a\nb\0\u2028c"]
    curve = al.allan_curve(Recording.from_rate(y, rate=10.0, unit="deg/s", names=names))
    path = curve.to_csv(tmp_path / "allan.csv")
    (heads,) = (row for row in path.read_text(encoding="utf-8").split("\n") if row.startswith("m,tau"))
    assert heads.split(",")[2::5] == ["'=1+1.deviation", r"a\nb\u0000\u2028c.deviation"]
    again = al.AllanCurve.from_csv(path)
    assert again.names == curve.names
    np.testing.assert_array_equal(again.deviation, curve.deviation)


def test_channels_are_reached_by_name() -> None:
    y = np.random.default_rng(1).standard_normal((500, 3))
    curve = oadev(y)
    assert curve["y"].names == ("y",) and curve["y"].deviation.shape == (len(curve.lags), 1)
    with pytest.raises(InputError, match="x, y, z"):
        curve["w"]
    with pytest.raises(ValueError, match="read-only"):
        curve.deviation[0] = 1.0
    with pytest.raises(InputError, match="statistic"):
        oadev(y, statistic="xdev")
    with pytest.raises(InputError, match="engine"):
        oadev(y, engine="warp")
