"""
Compiled kernels. Arrays are float64 or int64, C-contiguous, and never converted here.
"""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray


def integrate(block: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], offset: float, start: float, out: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> float:
    """
    Phase of one block of rate samples: out[i] = start + sum of (block[k] - offset), k <= i.

    A missing sample (NaN, infinite, or 9.9e37 and beyond) adds nothing. Returns the last value: the start
    of the next block. Cutting the record into other blocks gives the same digits.
    """

def missing_runs(block: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], start: int) -> Annotated[NDArray[numpy.int64], dict(shape=(None, 2), order='C')]:
    """
    Half-open runs of missing samples, shape (k, 2); `start` is the index of block[0] in the record.
    """

def difference_squares(phase: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], order: int, lags: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], runs: Annotated[NDArray[numpy.int64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], run_offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], first_block: int, last_block: int, block: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]:
    """
    Sums of squared differences, shape (last_block - first_block, n_lags).

    order 2: second differences (Allan), window 2m samples; order 3: third differences (Hadamard), 3m.
    runs[run_offsets[l]:run_offsets[l + 1]] are the half-open, sorted runs of starts whose window is complete
    at lag l; block b holds the starts [b * block, (b + 1) * block). A sum depends on its block and lag alone.
    """

def modified_squares(phase: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], lag: int, runs: Annotated[NDArray[numpy.int64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> float:
    """
    Sum over the starts of `runs` of (mean of `lag` adjacent second differences)**2.

    The window of a start holds 3 lag - 1 samples.
    """

def total_squares(phase: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], lag: int) -> float:
    """
    Sum of squared second differences of the reflected phase over the centres 1..n-1. No gaps.
    """

def theo_squares(head: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], tail: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], depth: int, runs: Annotated[NDArray[numpy.int64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> float:
    """
    Theo1: sum over the windows of `runs` and d = 1..depth of
    ((tail[i+depth] - tail[i+depth-d]) - (head[i+d] - head[i]))**2 / d. For the phase itself depth = m/2 and
    tail = phase[m - depth:]; for every s-th point of it head = phase[::s], tail = phase[m - s * depth::s].
    """

def biweight_sums(phase: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], lag: int, runs: Annotated[NDArray[numpy.int64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], scale: float, cut: float) -> tuple[float, float]:
    """
    Sums of psi(u) and u psi'(u), psi(u) = u (1 - u/cut)**4 below the cut and 0 above, over the second
    differences d of `runs`, u = d**2 / scale.
    """

def curve_weight(relative: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], discrepancy: float, least: float) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')], Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], float]:
    """
    Weights of the moment fit for one record: inverse factor of the covariance of the cube roots, lower
    triangular (n_lags, n_lags), their means (n_lags,), and the logarithm of its determinant, NaN where it has no
    factor. `relative`: covariance of the variances over the products of their means; `discrepancy`: relative
    error of the model at each lag; `least`: lower bound on the degrees of freedom of a lag.
    """

def curve_levels(variance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], means: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], weights: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], parts: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None, None), order='C', device='cpu', writable=False)], tables: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], discrepancy: float, least: float) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
    """
    Minus twice the log-likelihood of a curve under many models, up to a constant, (n_models,); infinite where a
    covariance has no factor. `means` (n_models, n_lags); the covariance of a model is the sum of its `weights`
    (n_models, n_parts) times the `parts` (n_tables, n_parts, n_lags, n_lags) of its table; `tables` (n_models,);
    the rest as for `curve_weight`.
    """

def curve_step(variance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], columns: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], here: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], means: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], whiten: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], starts: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], centre: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
    """
    Newton step of the moment fit from the coefficients `here` (p,), whose means are `means` (n_lags,), to the
    non-negative minimum of the quadratic part of r'r + 2/3 sum(log(means)), with
    r = whiten @ (cbrt(variance / means) - centre); columns (n_lags, p): change of the means. Gauss-Newton
    where that is not convex, zeros where nothing shows a way. whiten (n_lags, width): row i holds the columns from
    starts[i] to i of a lower triangular matrix; starts (n_lags,) are zeros for one record.
    """

def curve_minimum(variance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], columns: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], rest: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], here: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], whiten: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], starts: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], centre: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], steps: int, settled: float) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
    """
    Coefficients, none negative, at which means = rest + columns @ x minimise what curve_step() is of: at most
    `steps` steps from `here`, each halved until it does not climb, until one gains less than `settled`.
    """

def gamma_tails(shape: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]:
    """
    Regularised incomplete gamma functions P(shape, x) and Q(shape, x) = 1 - P, the rows of (2, n).
    """

def gamma_quantiles(shape: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], tail: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], upper: bool) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
    """x at which P(shape, x), or Q with `upper`, equals `tail`; shape (n,)."""

def window_pairs(lengths: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], distance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], spike: float, linear: float, cubic: float, exponential: float, rate: float) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
    """
    Covariance of second differences over m1 and m2 samples of a phase of generalised covariance
    S(t) = spike [t = 0] + linear |t| + cubic |t|**3 + exponential (exp(-u) + u), u = rate |t|:
    sum over i, j of w[i] w[j] S(k + j m2 - i m1) / (2 m1 m2), w = (1, -2, 1), at every distance k.

    lengths (n_pairs, 2): m1 <= m2. distance[offsets[p]:offsets[p + 1]] are those of pair p; offsets
    (n_pairs + 1). Constants and t**2 in S cancel.
    """

def power_window_pairs(lengths: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], distance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], exponents: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]:
    """
    The same for S(t) = |t|**(2 + e) of several exponents e between -1 and 1, shape (n_exponents, n_distances);
    t**2 log|t| where e is 0. Windows more than fifty lengths apart: by the fourth derivative.
    """

def pairs_in_runs(first: Annotated[NDArray[numpy.int64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], second: Annotated[NDArray[numpy.int64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], distance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')]:
    """
    How many positions i of the runs `first` have i + k in the runs `second`, at every distance k, linear between
    whole k. Runs: begin and end of each, none empty, rising, none touching the next, shape (n, 2).
    """

def pool_likelihood(c: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], rows: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], pools: Annotated[NDArray[numpy.int64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], moments: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], values: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], tilts: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], slope: float, averaged: bool) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]]:
    """
    Minus twice the log-likelihood of pools of vectors and of single values, less constants; the slope of a ramp
    and the information on it; the gradient with each row (one vector); and the expected information (matrix).
    Infinity and zeros where a covariance is not positive definite.

    c (n): variance coefficients. rows (size >= n, width): what each coefficient, and whatever else, changes the
    covariances (d * d) of the pools and the variances of the values by, side by side. pools (P, 3): components
    d, how many of the last are given, number of vectors. moments: of each pool mean (d), what a ramp makes of it
    (d), second moments (d * d). slope: NaN for the best; the likelihood is then the mean over all if `averaged`.
    """

def online_allan_size(lags: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], order: int = 2, positions: int = 64, block: int = 1024) -> tuple[int, int]:
    """
    Lengths of the two arrays of a state: `numbers` (float64) and `counters` (int64). Begin with zeros.

    lags: rising; each below 2 * positions, or q * 2**k with q in [positions, 2 * positions). A lag is never
    rounded: one that does not fit is refused. order as in difference_squares().
    """

def online_allan_feed(numbers: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], counters: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu')], lags: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], order: int, positions: int, block: int, samples: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], offset: float) -> None:
    """
    Take in the next rate samples, missing ones included: one pass, fixed memory, any chunking, same digits.

    `offset` is removed from each sample; it must stay the same for the whole record.
    """

def online_allan_read(numbers: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], counters: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu')], lags: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], order: int, positions: int, block: int) -> tuple[Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C')], Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')]]:
    """
    Sums of squared differences so far and how many there are, per lag. Changes nothing.

    A lag of level k = max(0, floor(log2(lag / positions))) has one start per 2**k samples. Sums and counts of
    separate pieces of a record, or of several records, simply add.
    """

def lagged_products(x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], first: int, out: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], portable: bool = False) -> None:
    """
    out[j] = sum of x[i] * x[i - j] over i >= max(first, j), for j = 0 ... len(out) - 1.

    portable: as in kalman_strands().
    """

def markov_noise(normals: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], phi: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], step_sd: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], weight_now: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], weight_next: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], state: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], out: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> None:
    """
    Add a weighted sum of first-order Markov states to `out`, in place.

    s_j(k+1) = phi[j] * s_j(k) + step_sd[j] * normals[k, j];
    out[k] += sum over j of weight_now[j] * s_j(k) + weight_next[j] * s_j(k+1).
    phi = 1 is a random walk. `state` holds s(0) before and s(n) after the call.
    """

def whiten(transition: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], process: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], output: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], noise: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], state: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], columns: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')]) -> float:
    """
    Filter c columns with the gain of one covariance recursion: out = innovation / sqrt(S), row by row.

    State-space model s' = F s + w, y = h s + v: transition F (n, n), process Cov w (n, n), output h (n,),
    noise Var v of each row. covariance (n, n) and state (n, c), in and out: prediction for the first row
    before the call, for the row after the last behind it. A row whose noise or a sample of which is NaN or
    infinite is missing: NaN in `out`, predict only. `out` may be `columns`. Returns the sum of ln S over the
    rows that are present; NaN if a noise is negative or an S is not positive.
    """

def kalman_filter(transition: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], process: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], output: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], noise: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], y: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], drive: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], readout: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], state: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], directions: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], sums: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], counts: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu')], means: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], sds: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], innovations: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], variances: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], square_root: bool) -> None:
    """
    Filter a block of rows: y = H s + v, Cov v = noise; s' = F s + drive + w, Cov w = process.

    output (1 or rows, p, n) and noise (1 or rows, p, p): constant or one for each row. y (rows, p): NaN and
    infinite are missing. drive (rows, n), or (0, n) for none. readout (g, n).
    Carried, in and out, so that the cuts into blocks leave no trace: state (n,) and covariance (n, n), the
    prediction for the next row (square_root: the factors of the covariance, see kalman_factor());
    directions (n, n), the first counts[2] rows span what is still diffuse;
    sums (4,) = [1, 0, 0, 1] before the first row: mantissa of the product of S, sum of v**2 / S and what it
    could not hold, mantissa of the product of F_inf;
    counts (6,) = [0, 0, diffuse rank, 0, 0, 0] before the first row: proper innovations (scalars), exponent
    of the product of S, diffuse rank left, diffuse updates, exponent of the product of F_inf, measurements
    skipped because R < 0 or S is not positive.
    Out, each with no rows if it is not wanted: means and sds (rows, g) of readout @ s after the update of the
    row (NaN and infinite where it is still diffuse); innovations and variances (rows, p), each component
    given those before it, decorrelated if noise is not diagonal (NaN, NaN if missing or skipped; NaN,
    infinite in a diffuse update). ValueError if square_root and process is not positive semidefinite.
    """

def kalman_drift(transition: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], process: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], output: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], noise: float, a: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], g: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], h: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], y: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], drift: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], readout: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], first: int, step: int, state: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], directions: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], sums: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], counts: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu')], drift_mean: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], drift_sd: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], standardized: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], means: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], sds: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], square_root: bool, portable: bool = False) -> None:
    """
    Filter a block of samples of a constant model: y = h s + v, Var v = noise; s' = F s + w, Cov w = process.

    a, g, h (steps, n, n): the covariance over 2**j rows, P' = h[j] + a[j].T @ P @ inv(1 + g[j] @ P) @ a[j].
    With six steps or more the gain is taken from polynomials between gaps, exact to 1e-10 of itself; without
    steps, and in the square-root form, each row has its own covariance.
    Carried, in and out: state, covariance, directions, sums and counts as in kalman_filter().
    Out, after the update of a row: mean and standard deviation of drift @ s at each row, of readout (g, n) @ s
    at the rows first, first + step, ...; standardized: innovation / sqrt(S), NaN where there is none.
    ValueError if square_root and process is not positive semidefinite. portable: as in kalman_strands().
    """

def kalman_draw(transition: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], process: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], output: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], noise: float, a: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], g: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], h: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], state: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], samples: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], portable: bool = False) -> None:
    """
    Normal numbers become samples of a constant model, in place: each is the innovation of its sample, over
    its standard deviation, so one number a sample is enough whatever the number of states.

    Model and steps as in kalman_drift(). Carried, in and out: state (n,) and covariance (n, n), the prediction
    for the next row.
    """

def kalman_likelihood(sums: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], counts: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> tuple[float, float]:
    """
    Log-likelihood of the proper innovations, -ln(2 pi)/2 each included, and the sum of ln F_inf of the
    diffuse updates (which means something once the diffuse rank is 0), from the sums and counts of
    kalman_filter().
    """

def kalman_strands(transition: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], process: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], output: Sequence[Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]], noise: Sequence[Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]], y: Sequence[Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]], numbers: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], counters: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu')], square_root: bool, portable: bool = False) -> bool:
    """
    Filter a block of rows of four stretches of a record side by side, each from a guess of its first state.

    One to four states, scalar measurements, nothing diffuse. output, noise and y: four arrays each, of shapes
    (1 or rows, n), (1 or rows,) and (rows,); NaN and infinite samples are missing.
    Carried, in and out, numbers (1 + n + 2 n**2 + (n + 1)**2, 4), a column for each strand: state (n),
    covariance (n * n; square_root: its factors), effect of an error of the guess on the state (n * n, column
    by column), upper half of the sums of products of innovation and effects on it, over S ((n + 1)**2),
    mantissa of the product of S (1). Before the first row: guess, zeros, unit matrix, zeros, 1.
    counters (8,), zeros before the first row: four exponents of the product of S, four counts of innovations.
    False, and what is carried is spoilt, where a noise is not positive, an output is not finite, an innovation
    has no variance or process is not positive semidefinite. portable: without the instructions that not every
    processor has; the digits are the same.
    """

def kalman_factor(covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')]) -> bool:
    """
    P becomes U and D of P = U D U', in place: D on the diagonal, the unit upper triangular U above it.

    False if P is not positive semidefinite; it is spoilt then.
    """

def kalman_compose(factors: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')]) -> None:
    """U and D become P = U D U', in place."""

def kalman_smooth(transition: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], process: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], output: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], noise: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], y: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], drive: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], readout: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], state: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], covariance: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], directions: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], rank: int, final_rank: int, gradient: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], information: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], means: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], sds: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], square_root: bool) -> None:
    """
    Smooth a block of rows; go through the blocks from the last to the first.

    The model, the rows and the readout as in kalman_filter(); state, covariance, directions and rank
    (= counts[2]) as they were before the block, final_rank as it is behind the last row of the record.
    gradient (n,) and information (n, n): zeros before the last block, then in and out. means and sds
    (rows, g) of readout @ s given the whole record (NaN and infinite where it does not tell).
    """
