"""
Compiled kernels. Arrays are float64 or int64, C-contiguous, and never converted here.
"""

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

def markov_noise(normals: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], phi: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], step_sd: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], weight_now: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], weight_next: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], state: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], out: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> None:
    """
    Add a weighted sum of first-order Markov states to `out`, in place.

    s_j(k+1) = phi[j] * s_j(k) + step_sd[j] * normals[k, j];
    out[k] += sum over j of weight_now[j] * s_j(k) + weight_next[j] * s_j(k+1).
    phi = 1 is a random walk. `state` holds s(0) before and s(n) after the call.
    """
