# SPDX-License-Identifier: BSD-3-Clause
"""The states given the whole record: forward once, keeping a checkpoint at each block; then block by block backwards.

A block is filtered again from its checkpoint when its turn comes, so memory does not grow with the record.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite import _kernels
from allanite.filtering.kalman.checks import checked_row
from allanite.filtering.kalman.filtering import Checkpoint, FilterRun, Form
from allanite.filtering.kalman.sides import Sides
from allanite.lazy_dataclasses import dataclass
from allanite.noise import StateSpace
from allanite.recording.records import BLOCK

__all__ = ["Smoothed", "block_rows", "smooth", "smoothed_blocks"]

Array = NDArray[np.float64]

#: Bytes that the smoother of one block may take.
_BYTES = 1 << 24


@dataclass(frozen=True, slots=True, kw_only=True)
class Smoothed:
    """States given the whole record.

    Attributes
    ----------
    readout, readout_sd : ndarray, shape (rows, g)
        What was asked for of the states, and its standard deviation; NaN and infinity where the record leaves it
        undetermined.
    log_likelihood : float
        Of the samples, as `kalman.log_likelihood` states it.
    count : int
        Innovations in it.
    skipped : int
        See `FilterResult`.
    form : "covariance" or "square root"
    """

    readout: Array
    readout_sd: Array
    log_likelihood: float
    count: int
    skipped: int
    form: Form

    def __repr__(self) -> str:
        return f"<Smoothed of {len(self.readout)} rows, log-likelihood {self.log_likelihood:.6g}>"


def smooth(
    y: ArrayLike,
    space: StateSpace,
    *,
    outputs: ArrayLike | None = None,
    drive: ArrayLike | None = None,
    noise: ArrayLike | None = None,
    readout: ArrayLike | None = None,
    state: ArrayLike | None = None,
    form: Form = "covariance",
) -> Smoothed:
    """Fixed-interval smoother.

    Parameters
    ----------
    y : array_like, shape (rows,)
    readout : array_like, shape (g, n), optional
        Combinations of the states that are wanted; each state by default.

    Other parameters, and what is refused, are those of `run_filter`.

    References
    ----------
    J. Durbin, S. J. Koopman, "Time Series Analysis by State Space Methods", 2nd ed., 2012, sections 4.4 and 5.3.
    """
    samples = checked_row(y, "y")
    run = FilterRun(
        space, readout=np.eye(np.size(space.output)) if readout is None else readout, form=form, state=state
    )
    sides = Sides(outputs, drive, noise, run.space.size)
    size, checkpoints = block_rows(run.space.size), []
    for start in range(0, len(samples), size):
        checkpoints.append(run.checkpoint())
        block = samples[start : start + size]
        run.feed(block, readout=False, innovations=False, **sides.of(start, len(block)))
    sides.finish(len(samples))

    def again(index: int) -> tuple[Array, dict[str, Array | None]]:
        block = samples[index * size : (index + 1) * size]
        return block, sides.of(index * size, len(block))

    means, sds = (np.empty((len(samples), len(run.readout))) for _ in range(2))
    for index, mean, sd in smoothed_blocks(run, checkpoints, again):
        rows = slice(index * size, index * size + len(mean))
        means[rows], sds[rows] = mean, sd
    for array in (means, sds):
        array.flags.writeable = False
    return Smoothed(
        readout=means,
        readout_sd=sds,
        log_likelihood=run.log_likelihood,
        count=run.count,
        skipped=run.skipped,
        form=form,
    )


def block_rows(n: int) -> int:
    """Rows of a block whose smoother takes some megabytes, for n states."""
    return int(np.clip(_BYTES // (8 * (2 * n * n + 4 * n + 8)), 64, BLOCK))


def smoothed_blocks(
    run: FilterRun,
    checkpoints: Sequence[Checkpoint],
    again: Callable[[int], tuple[Array, dict[str, Array | None]]],
) -> Iterator[tuple[int, Array, Array]]:
    """From the last block to the first: number of the block, readout and its standard deviation at its rows.

    Parameters
    ----------
    run : FilterRun
        After the last block.
    checkpoints : sequence of Checkpoint
        Before each block.
    again : callable
        Samples of a block, and its rows of outputs, drive and noise.
    """
    space, n = run.space, run.space.size
    gradient, information = np.zeros(n), np.zeros((n, n))
    for index in range(len(checkpoints) - 1, -1, -1):
        block, sides = again(index)
        outputs, drive, noise = (sides.get(k) for k in ("outputs", "drive", "noise"))
        before = checkpoints[index]
        means, sds = (np.empty((len(block), len(run.readout))) for _ in range(2))
        _kernels.kalman_smooth(
            space.transition,
            space.process,
            space.output[None, None] if outputs is None else outputs[:, None],
            np.full((1, 1, 1), space.noise) if noise is None else noise[:, None, None],
            block[:, None],
            np.zeros((0, n)) if drive is None else drive,
            run.readout,
            before.state,
            before.covariance,
            before.directions,
            before.rank,
            run.unresolved,
            gradient,
            information,
            means,
            sds,
            run.square_root,
        )
        yield index, means, sds
