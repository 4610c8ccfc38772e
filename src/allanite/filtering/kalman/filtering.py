# SPDX-License-Identifier: BSD-3-Clause
"""The Kalman filter of a StateSpace on samples of one channel, block by block, whatever the length of the record.

    y_k = h_k s_k + v_k,   s_{k+1} = F s_k + u_k + w_k:   update first, then predict.

A missing sample (NaN) is predicted over. States of which nothing is known at first start exactly so (diffuse): no
large number stands for ignorance, and rescaling the samples rescales the answers and nothing else.

References
----------
.. [1] J. Durbin, S. J. Koopman, "Time Series Analysis by State Space Methods", 2nd ed., 2012, chapters 4, 5 and 7.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite import _kernels
from allanite.errors import InputError
from allanite.filtering.kalman.checks import checked_matrix, checked_row, checked_space
from allanite.filtering.kalman.sides import Rowwise, Sides
from allanite.filtering.kalman.steady import riccati_steps
from allanite.filtering.kalman.strands import MOST_STATES, Strand, joined, product, run_strands
from allanite.lazy_dataclasses import dataclass
from allanite.noise import StateSpace
from allanite.recording.records import BLOCK

__all__ = ["Checkpoint", "DriftRows", "FilterResult", "FilterRun", "Form", "log_likelihood", "run_filter"]

Array = NDArray[np.float64]
Form = Literal["covariance", "square root"]

FORMS = ("covariance", "square root")

#: Rows from which on strands gain more than they cost.
LONG = 1 << 18
#: The part of a long record that is filtered row by row before: it gives the strands their guesses.
FIRST_PART = 128
#: Rows from which on polynomials of the gain gain more than they cost, and steps of the covariance for them: those over
#: 1, 2, 4 ... 2^13 rows, of which eight make a segment of 2^16.
SEGMENTS_FROM, STEPS = 1 << 13, 14
#: `most_segment_states` of kernels/include/allanite/gain_filter.hpp: models with more go row by row.
MOST_SEGMENT_STATES = 48


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterResult:
    """What a filter makes of its rows.

    Attributes
    ----------
    innovations, variances : ndarray, shape (rows,)
        Sample less its prediction, and the variance of that. A missing row is NaN in both; a row that the diffuse
        start used up has an innovation of NaN and an infinite variance.
    readout, readout_sd : ndarray, shape (rows, g)
        What was asked for of the states, after the update of the row, and its standard deviation; NaN and infinity
        where it hangs on a state of which nothing is known yet.
    state : ndarray, shape (n,)
        Prediction for the row after the last.
    covariance : ndarray, shape (n, n)
        Of that prediction; of the part that is known while `unresolved` is not zero.
    log_likelihood : float
        See `log_likelihood`.
    count : int
        Innovations in it.
    diffuse_rows : int
        Rows that the diffuse start used up.
    unresolved : int
        Directions of the state of which nothing is known after the last row.
    skipped : int
        Rows that were taken for missing because their innovation had no positive variance: samples without noise of
        a state that is known already, or, in the covariance form, a covariance that rounding has broken.
    form : "covariance" or "square root"
    """

    innovations: Array
    variances: Array
    readout: Array
    readout_sd: Array
    state: Array
    covariance: Array
    log_likelihood: float
    count: int
    diffuse_rows: int
    unresolved: int
    skipped: int
    form: Form

    def __repr__(self) -> str:
        return f"<FilterResult of {self.count} innovations, log-likelihood {self.log_likelihood:.6g}>"


@dataclass(frozen=True, slots=True, kw_only=True)
class Checkpoint:
    """Everything a filter carries from one row to the next; covariance or its factors, by the form."""

    state: Array
    covariance: Array
    directions: Array
    rank: int


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftRows:
    """What one readout is at each row of a block, and others are at some.

    Attributes
    ----------
    mean, sd : ndarray, shape (rows,)
        Of the readout, after the update of the row; NaN and infinity where it is not known yet.
    standardized : ndarray, shape (rows,)
        Innovation over its standard deviation; NaN where there is none.
    means, sds : ndarray, shape (instants, g)
        Of the other readouts.
    whole : bool
        Each row has an innovation.
    """

    mean: Array
    sd: Array
    standardized: Array
    means: Array
    sds: Array
    whole: bool


class FilterRun:
    """A filter under way: feed it blocks; the cuts between them leave no trace.

    Parameters
    ----------
    space : StateSpace
    readout : array_like, shape (g, n), optional
        Combinations of the states that are wanted at each row.
    form : "covariance" or "square root"
        The second keeps factors of the covariance, which no rounding can break; it takes a few times as long.
    state : array_like, shape (n,), optional
        Mean of the states before the first row; zero by default, and of no matter where they are diffuse.

    Raises
    ------
    InputError
        A model, readout, form or state that makes no sense.
    """

    def __init__(
        self,
        space: StateSpace,
        *,
        readout: ArrayLike | None = None,
        form: Form = "covariance",
        state: ArrayLike | None = None,
    ) -> None:
        if form not in FORMS:
            raise InputError(f"form must be 'covariance' or 'square root', not {form!r}")
        self.space, self.form = checked_space(space), form
        n = self.space.size
        self.readout = np.zeros((0, n)) if readout is None else _combinations(readout, n)
        self._state = np.zeros(n) if state is None else checked_matrix(state, (n,), "state").copy()
        known = ~self.space.diffuse
        self._covariance = np.ascontiguousarray(self.space.initial * known * known[:, None])
        if self.square_root and not _kernels.kalman_factor(self._covariance):
            raise InputError("initial is no covariance: it is not positive semidefinite")
        self._directions = np.zeros((n, n))
        rank = int(self.space.diffuse.sum())
        self._directions[:rank] = np.eye(n)[self.space.diffuse]
        self._sums = np.array([1.0, 0.0, 0.0, 1.0])
        self._counts = np.array([0, 0, rank, 0, 0, 0], dtype=np.int64)
        self._steps: tuple[Array, Array, Array] | None = None

    @property
    def square_root(self) -> bool:
        """The form keeps factors."""
        return self.form == "square root"

    def feed(
        self,
        y: Array,
        *,
        outputs: Array | None = None,
        drive: Array | None = None,
        noise: Array | None = None,
        readout: bool = True,
        innovations: bool = True,
    ) -> tuple[Array, Array, Array, Array]:
        """Filter the next rows; the optional arrays have one row for each.

        Returns
        -------
        innovations, variances : ndarray, shape (rows,)
        readout, readout_sd : ndarray, shape (rows, g)
            Empty where they are not wanted.
        """
        rows, space = len(y), self.space
        n, g = space.size, len(self.readout) if readout else 0
        errors, variances = (np.empty((rows if innovations else 0, 1)) for _ in range(2))
        means, sds = (np.empty((rows if g else 0, g)) for _ in range(2))
        _kernels.kalman_filter(
            space.transition,
            space.process,
            space.output[None, None] if outputs is None else outputs[:, None],
            np.full((1, 1, 1), space.noise) if noise is None else noise[:, None, None],
            y[:, None],
            np.zeros((0, n)) if drive is None else drive,
            self.readout[:g],
            self._state,
            self._covariance,
            self._directions,
            self._sums,
            self._counts,
            means,
            sds,
            errors,
            variances,
            self.square_root,
        )
        return errors[:, 0], variances[:, 0], means, sds

    def feed_drift(
        self, y: Array, drift: Array, *, first: int, step: int, rows: int, memory: Array | None = None
    ) -> DriftRows:
        """Filter the next rows, with the state-space model's constant output and noise.

        In a long record, and the covariance form, the gain comes from polynomials in time between gaps: estimates and
        their standard deviations are within 1e-9 standard deviations of those of the filter row by row.

        Parameters
        ----------
        y : ndarray, shape (rows,)
        drift : ndarray, shape (n,)
            The readout of each row; `readout` is taken at the rows `first`, `first` + `step`, ...
        rows : int
            Length of the record.
        memory : ndarray, shape (3, at least len(y)), optional
            Where the results of each row go.
        """
        space, count, size = self.space, self.count, len(y)
        if self._steps is None:
            uses = rows >= SEGMENTS_FROM and not self.square_root and space.noise > 0
            self._steps = riccati_steps(space, STEPS if uses else 0)
        mean, sd, standardized = (np.empty((3, size)) if memory is None else memory)[:, :size]
        means, sds = (np.empty((len(range(first, size, step)), len(self.readout))) for _ in range(2))
        _kernels.kalman_drift(
            space.transition,
            space.process,
            space.output,
            space.noise,
            *self._steps,
            y,
            drift,
            self.readout,
            first,
            step,
            self._state,
            self._covariance,
            self._directions,
            self._sums,
            self._counts,
            mean,
            sd,
            standardized,
            means,
            sds,
            self.square_root,
        )
        whole = self.count - count == size
        return DriftRows(mean=mean, sd=sd, standardized=standardized, means=means, sds=sds, whole=whole)

    def join(self, strand: Strand) -> bool:
        """Go on by a strand that begins at the next row; False, and nothing done, where digits would be lost."""
        after = joined(strand, self._state, self._covariance, square_root=self.square_root)
        if after is None:
            return False
        self._state[:], self._covariance[:] = after.state, after.covariance
        before = self._sums[1]
        term = after.squares + self._sums[2]
        self._sums[1] = before + term
        self._sums[2] = term - (self._sums[1] - before)  # what the sum could not hold
        self._sums[0], exponent = product(*after.variances, self._sums[0])
        self._counts[:2] += after.count, exponent
        return True

    def checkpoint(self) -> Checkpoint:
        """A copy of what the filter carries on."""
        return Checkpoint(
            state=self._state.copy(),
            covariance=self._covariance.copy(),
            directions=self._directions.copy(),
            rank=self.unresolved,
        )

    @property
    def count(self) -> int:
        """Innovations so far."""
        return int(self._counts[0])

    @property
    def unresolved(self) -> int:
        """Directions of the state of which nothing is known yet."""
        return int(self._counts[2])

    @property
    def diffuse_rows(self) -> int:
        """Rows that the diffuse start has used up."""
        return int(self._counts[3])

    @property
    def skipped(self) -> int:
        """Rows taken for missing because their innovation had no positive variance."""
        return int(self._counts[5])

    @property
    def log_likelihood(self) -> float:
        """Of the rows so far; see the function of this name."""
        proper, diffuse = _kernels.kalman_likelihood(self._sums, self._counts)
        return float(proper) - 0.5 * float(diffuse)

    @property
    def state(self) -> Array:
        """Prediction for the next row, shape (n,)."""
        return self._state.copy()

    @property
    def covariance(self) -> Array:
        """Of the prediction for the next row, shape (n, n)."""
        whole = self._covariance.copy()
        if self.square_root:
            _kernels.kalman_compose(whole)
        return whole


def run_filter(
    y: ArrayLike | Iterable[ArrayLike],
    space: StateSpace,
    *,
    outputs: Rowwise | None = None,
    drive: Rowwise | None = None,
    noise: Rowwise | None = None,
    readout: ArrayLike | None = None,
    state: ArrayLike | None = None,
    form: Form = "covariance",
    store: bool = True,
    threads: int | None = None,
) -> FilterResult:
    """Filter samples of one channel.

    Parameters
    ----------
    y : array_like, shape (rows,), or iterable of such blocks
        NaN (and infinity) is a missing sample. Blocks are taken one by one, so the record may exceed memory.
    space : StateSpace
        ``model.state_space(dt)``, with ``.with_constant()`` where the record has a level of its own.
    outputs : array_like, shape (rows, n), or callable, optional
        Time-varying h, in place of `space.output`. Here and below a function (start, stop) that gives those rows stands
        for an array that would not fit into memory; several threads may call it.
    drive : array_like, shape (rows, n), or callable, optional
        Known input: added to the prediction from each row to the next (B u of a control input).
    noise : array_like, shape (rows,), or callable, optional
        Variance of v for each row, in place of `space.noise`.
    readout : array_like, shape (g, n), optional
        Combinations of the states that are wanted at each row, after its update: ``np.eye(n)`` for all.
    state : array_like, shape (n,), optional
        Mean of the states before the first row; zero by default.
    form : "covariance" or "square root"
    store : bool
        Keep the rows of the result; without them only sums and the last state are left, in fixed memory. An array of
        many samples of a model of up to four states, without drive, is then filtered in strands side by side, several
        times as fast; the result is that of the filter but for rounding.
    threads : int, optional
        For those strands; one for each processor by default. Any number gives the same digits.

    Raises
    ------
    InputError
        Wrong shapes, numbers that are not finite, a negative variance, or a matrix that is no covariance.

    Examples
    --------
    >>> from allanite.noise import NoiseModel, White
    >>> space = NoiseModel.of(White(N=1.0)).state_space(1.0).with_constant()
    >>> result = run_filter([1.0, 2.0, np.nan, 6.0], space, readout=[[1.0]])
    >>> result.readout[:, 0].tolist()
    [1.0, 1.5, 1.5, 3.0]
    """
    run = FilterRun(space, readout=readout, form=form, state=state)
    sides = Sides(outputs, drive, noise, run.space.size)
    pieces: list[tuple[Array, ...]] = []
    if isinstance(y, np.ndarray) and not store:
        sides.finish(_feed_lean(run, y, sides, threads))
    else:
        rows = 0
        for start, block in _blocks(y):
            beside = sides.of(start, len(block))
            pieces.append(run.feed(block, readout=store, innovations=store, **beside))
            rows = start + len(block)
        sides.finish(rows)
    empty = (np.empty(0), np.empty(0), np.empty((0, len(run.readout))), np.empty((0, len(run.readout))))
    errors, variances, means, sds = (np.concatenate(c) for c in zip(*(pieces or [empty]), strict=True))
    return FilterResult(
        innovations=_final(errors),
        variances=_final(variances),
        readout=_final(means),
        readout_sd=_final(sds),
        state=_final(run.state),
        covariance=_final(run.covariance),
        log_likelihood=run.log_likelihood,
        count=run.count,
        diffuse_rows=run.diffuse_rows,
        unresolved=run.unresolved,
        skipped=run.skipped,
        form=form,
    )


def log_likelihood(
    y: ArrayLike | Iterable[ArrayLike],
    space: StateSpace,
    *,
    outputs: Rowwise | None = None,
    drive: Rowwise | None = None,
    noise: Rowwise | None = None,
    form: Form = "covariance",
    threads: int | None = None,
) -> float:
    """Log-likelihood of samples under a model, with all its constants.

    Parameters are those of `run_filter`.

    Returns
    -------
    float
        -1/2 sum over the innovations of ln(2 pi S) + e^2/S, less 1/2 sum of ln F_inf over the rows that the diffuse
        start used up [1, eq. 7.3 and 7.4, without the constants of those rows]: the likelihood of the contrasts that
        the unknown starting values do not enter. NaN where the samples do not end the diffuse start.
    """
    result = run_filter(
        y, space, outputs=outputs, drive=drive, noise=noise, form=form, store=False, threads=threads
    )
    return math.nan if result.unresolved else result.log_likelihood


# -- rows ------------------------------------------------------------------------------------------------------


def _feed_lean(run: FilterRun, y: Array, sides: Sides, threads: int | None) -> int:
    """All samples of an array, of which only the sums are wanted. Returns their number."""
    if threads is not None and threads < 1:
        raise InputError(f"threads must be at least 1, not {threads!r}")

    def one_by_one(start: int, stop: int) -> int:
        for begin in range(start, stop, BLOCK):
            block = checked_row(y[begin : min(begin + BLOCK, stop)], "y")
            run.feed(block, readout=False, innovations=False, **sides.of(begin, len(block)))
        return stop

    def beside(start: int, stop: int) -> tuple[Array, Array, Array]:
        block = checked_row(y[start:stop], "y")
        parts = sides.unlooked(start, stop - start)
        return block, parts.get("outputs", run.space.output[None]), parts.get("noise", constant)

    if y.ndim != 1:
        checked_row(y, "y")
    constant, rows, start = np.array([run.space.noise]), len(y), 0
    if rows >= LONG and run.space.size in range(1, MOST_STATES + 1) and "drive" not in sides:
        start = one_by_one(0, rows // FIRST_PART)
        while run.unresolved and start < rows:
            start = one_by_one(start, min(start + BLOCK, rows))
        for strand in run_strands(
            run.space, run.state, beside, start=start, stop=rows, square_root=run.square_root, threads=threads
        ):
            stop = start + strand.rows
            start = stop if run.join(strand) else one_by_one(start, stop)
    return one_by_one(start, rows)


def _combinations(readout: ArrayLike, n: int) -> Array:
    rows = np.shape(readout)[0] if np.ndim(readout) == 2 else 1
    return checked_matrix(readout, (rows, n), "readout")


def _blocks(y: ArrayLike | Iterable[ArrayLike]) -> Iterator[tuple[int, Array]]:
    """Pairs (first row, block of samples): an array is cut, other iterables are taken block by block."""
    if isinstance(y, np.ndarray) or (isinstance(y, (list, tuple)) and not any(np.ndim(b) for b in y[:1])):
        whole = np.asarray(y)
        if whole.ndim != 1:
            checked_row(whole, "y")
        for start in range(0, len(whole), BLOCK):
            yield start, checked_row(whole[start : start + BLOCK], "y")
        return
    if not isinstance(y, Iterable) or isinstance(y, (str, bytes)):
        raise InputError(f"y must be an array of samples or blocks of them, not {y!r}")
    start = 0
    for piece in y:
        block = checked_row(piece, "y")
        yield start, block
        start += len(block)


def _final(array: Array) -> Array:
    array.flags.writeable = False
    return array
