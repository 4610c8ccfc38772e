# SPDX-License-Identifier: BSD-3-Clause
"""The two-state filter of the seed paper [1], which is told the true rate: reference-aided, and no measurement.

The filter compares the sensor with a rate that is known, and estimates what is slow in the difference:

    y = reference - measured = -(z_f + z_rrw) - n,      H = [-1 -1],   R = N^2/Ts
    z_f: first-order Gauss-Markov, F_11 = exp(-Ts/T_b), S_B = 2 B^2 ln2/(pi 0.4365^2 T_b)
    z_rrw: random walk, F_22 = 1;                       Q_d = Ts diag(S_B, K^2), P_0 = 0.1 (deg/s)^2 I, x_0 = 0
    corrected = measured - z_f - z_rrw.

That is what a rate table needs: noise removed against a known input. It is circular where the rate is the question,
for the states take up whatever is slow and is not the reference. Two readings of the paper's Figs 10 to 13 exist:

unsigned
    The mean of the corrected samples, as the figures are described. It tends to the reference that was typed in,
    on average and slowly, whatever the sensor saw: `follows` is 1.
demodulated
    The reference and the corrected samples are taken with the sign of the heading, as the paper's reversals suggest.
    Then the sensor decides: twice the reference moves the result by some percent, and the result is about the plain
    pair difference, attenuated, because the filter takes part of the alternating signal for flicker.

Notes
-----
The paper prints the covariance update as (I - K H)^-1 P; (I - K H) P is meant and done here. Its Q_d is of first order
in Ts/T_b; ``exact=True`` has sigma^2 (1 - exp(-2 Ts/T_b)), sigma^2 = S_B T_b/2, in its place.

References
----------
.. [1] Silva, Jeronymo, Pavan, Tosin, "Caracterização de Sensores MEMS Através da Variância de Allan para a Filtragem
   de Ruídos Estocásticos".
"""

from __future__ import annotations

import math
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.experiments.aided_readings import (
    AidedReading,
    AidedStatement,
    AidedTake,
    ReadingKind,
    RunningMeans,
)
from allanite.filtering.kalman import TermSeries, run_filter
from allanite.filtering.kalman.channel import SampleSource, chosen
from allanite.filtering.kalman.series import POINTS, SeriesEnvelope, instants
from allanite.lazy_dataclasses import dataclass
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, StateSpace, White
from allanite.recording.records import Recording

__all__ = ["PRIOR", "ReferenceAided", "reference_aided", "seed_space"]

Array = NDArray[np.float64]
#: What a model writes for its terms.
_SYMBOLS = {White: "N", Flicker: "B", GaussMarkov: "a Gauss-Markov term", RandomWalk: "K"}

#: P_0 of both states: 0.1 (deg/s)^2, in (rad/s)^2.
PRIOR = 0.1 * math.radians(1) ** 2
#: Of the paper's S_B: the maximum of the Allan deviation of a Gauss-Markov term over q sqrt(T).
_PEAK = 0.4365


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceAided(AidedStatement):
    """What the seed paper's filter makes of a record, given the rate that it is to find. Not a measurement.

    Attributes
    ----------
    channel : str
    rate : float [Hz]
    reading : "unsigned" or "demodulated"
        What the means and the cumulative means are taken of: the samples, or the samples times their sign.
    reference : ndarray, shape (n_samples,) [SI]
        The rate that the filter was told, sign included.
    corrected : ndarray, shape (n_samples,) [SI]
        Measured, less both states; NaN where missing or turning.
    states, states_sd : ndarray, shape (n_samples, 2) [SI]
        z_f and z_rrw after the update of each row.
    cumulative_raw, cumulative_corrected : ndarray, shape (n_samples,) [SI]
        Means of the samples so far, NaN before the first.
    mean_reference, mean_raw, mean_corrected : float [SI]
        Means over the whole record: of what was typed in, of the sensor, and of the corrected samples.
    follows : float
        By how much `mean_corrected` moves for each unit that the reference is moved: 1, and the answer is the
        reference; 0, and the sensor decides.
    exact : bool
    left_out : tuple of str
        Terms of the model that the filter has no state for; `notes` say so.
    """

    channel: str
    rate: float
    reading: ReadingKind
    reference: Array = field(repr=False)
    corrected: Array = field(repr=False)
    states: Array = field(repr=False)
    states_sd: Array = field(repr=False)
    cumulative_raw: Array = field(repr=False)
    cumulative_corrected: Array = field(repr=False)
    mean_reference: float
    mean_raw: float
    mean_corrected: float
    follows: float
    exact: bool
    left_out: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<ReferenceAided {self.channel}, {self.reading}: follows its reference by {self.follows:.2f}>"

    @property
    def result(self) -> AidedTake:
        """What a document holds; of the long series no more than a picture needs."""
        rows = len(self.corrected)
        first, step = instants(rows)
        shown = slice(first, None, step)
        known = np.unique(np.linspace(0, rows - 1, POINTS).round().astype(np.int64))  # the last one, too
        middles: Array = (np.arange(rows, dtype=np.float64) + 0.5) / self.rate
        means = (
            "reading",
            "rate",
            "mean_reference",
            "mean_raw",
            "mean_corrected",
            "follows",
            "exact",
            "left_out",
        )
        reading = AidedReading(
            **{name: getattr(self, name) for name in means},
            corrected=SeriesEnvelope.of(self.rate, self.corrected),
            running=RunningMeans(
                t=middles[shown],
                raw=self.cumulative_raw[shown],
                corrected=self.cumulative_corrected[shown],
                reference=self.reference[shown],
            ),
            states=tuple(
                TermSeries(t=middles[known], value=self.states[known, i], sd=self.states_sd[known, i])
                for i in range(2)
            ),
        )
        return AidedTake(channel=self.channel, readings=(reading,))

    def to_json(self) -> dict[str, object]:
        """Plain data of `result`."""
        return self.result.to_json()


def reference_aided(
    recording: Recording,
    model: NoiseModel,
    *,
    reference: ArrayLike,
    signs: ArrayLike | None = None,
    T: float | None = None,
    channel: str | None = None,
    prior: float = PRIOR,
    exact: bool = False,
) -> ReferenceAided:
    """Run the seed paper's filter against a rate that is known, or is taken to be.

    Parameters
    ----------
    recording : Recording
        A missing sample is predicted over.
    model : NoiseModel
        White noise, flicker or one Gauss-Markov term, and a random walk where there is one; other terms have no state
        here, and the result says so.
    reference : float or array_like, shape (n_samples,) [SI]
        The true rate along the sensitive axis: constant, or at each sample (a rate table).
    signs : array_like, shape (n_samples,), optional
        Heading of each sample: +1, -1, and 0 where the sensor is turned. The reference is multiplied by it, and the
        result is demodulated. Without it the reading is unsigned.
    T : float, optional [s]
        Correlation time of flicker; not needed where the model has a Gauss-Markov term.
    channel : str, optional
        Needed where more than one could be meant.
    prior : float [SI^2]
        Variance of both states at first; the paper's 0.1 (deg/s)^2 by default.
    exact : bool
        Exact process noise in place of the paper's first order.

    Raises
    ------
    InputError
        A model without the terms of the filter, signs other than -1, 0 and 1, shapes that do not fit, or a prior that
        is no variance.

    Examples
    --------
    >>> from allanite.filtering.simulation import simulate
    >>> model = NoiseModel.of(White(N=2e-4), GaussMarkov.from_sigma(5e-5, 240.0), RandomWalk(K=1.2e-6))
    >>> record = simulate(model, rate=8.0, duration=600.0, seed=1)
    >>> reference_aided(record, model, reference=0.01)
    <ReferenceAided gyro, unsigned: follows its reference by 1.00>
    """
    facts, used = chosen(recording, model, channel)
    source = SampleSource(recording, facts)
    space = seed_space(used, 1 / recording.rate, T=T, prior=prior, exact=exact)
    heading = _signs(signs, source.rows)
    reference_rate = _reference(reference, source.rows)
    reference_rate = reference_rate if heading is None else reference_rate * heading
    measured = source.read(0, source.rows) + source.origin
    if heading is not None:
        measured = np.where(heading == 0, np.nan, measured)
    estimate = run_filter(reference_rate - measured, space, readout=np.eye(2))
    corrected = measured - estimate.readout.sum(axis=1)
    # The filter is linear and does not look at the samples' size: what it makes of the reference alone is its share.
    present = np.isfinite(measured)
    alone = run_filter(np.where(present, reference_rate, np.nan), space, readout=np.eye(2))
    share = np.where(present, -alone.readout.sum(axis=1), np.nan)
    weight = np.ones(source.rows) if heading is None else heading
    pattern = np.where(present, reference_rate, np.nan)
    mean_told = _mean(weight * pattern)
    return ReferenceAided(
        channel=facts.name,
        rate=recording.rate,
        reading="unsigned" if heading is None else "demodulated",
        reference=_final(reference_rate),
        corrected=_final(corrected),
        states=_final(np.array(estimate.readout)),
        states_sd=_final(np.array(estimate.readout_sd)),
        cumulative_raw=_final(_cumulative(weight * measured)),
        cumulative_corrected=_final(_cumulative(weight * corrected)),
        mean_reference=mean_told,
        mean_raw=_mean(weight * measured),
        mean_corrected=_mean(weight * corrected),
        follows=_mean(weight * share) / mean_told if mean_told else math.nan,
        exact=exact,
        left_out=_left_out(used),
    )


def seed_space(
    model: NoiseModel, dt: float, *, T: float | None = None, prior: float = PRIOR, exact: bool = False
) -> StateSpace:
    """The paper's F, H, R, Q_d and P_0 for samples at interval dt [s]; y is the reference less the sample.

    Raises
    ------
    InputError
        No white noise, no bias instability or more than one, flicker without a correlation time, or a prior that is
        no variance.
    """
    white, bias, walk = (
        [t for t in model.terms if isinstance(t, kind)]
        for kind in (White, (Flicker, GaussMarkov), RandomWalk)
    )
    if len(white) != 1 or len(bias) != 1 or len(walk) > 1:
        held = ", ".join(_SYMBOLS.get(type(t), type(t).__name__) for t in model.terms)
        raise InputError(
            "the reference-aided filter needs N, one bias instability (B, or a Gauss-Markov term) and at most one K; "
            f"the model has {held or 'no term'}: write one, as in 'N=0.3 deg/√h, B=5 deg/h, T=240 s'"
        )
    density, time = _bias(bias[0], T)
    if not (math.isfinite(prior) and prior > 0):
        raise InputError(f"prior is the variance of the states at first: positive, not {prior!r}")
    phi = math.exp(-dt / time)
    first = density * time / 2 * -math.expm1(-2 * dt / time) if exact else dt * density
    second = dt * sum(t.K**2 for t in walk if isinstance(t, RandomWalk))
    return StateSpace(
        transition=np.diag([phi, 1.0]),
        process=np.diag([first, second]),
        output=np.array([-1.0, -1.0]),
        noise=sum(t.N**2 for t in white if isinstance(t, White)) / dt,
        initial=prior * np.eye(2),
        rate=np.ones(2),
        labels=("gauss_markov", "random_walk"),
        diffuse=np.zeros(2, dtype=np.bool_),
    )


def _bias(term: Any, T: float | None) -> tuple[float, float]:
    """S_B and T_b of the bias instability."""
    if isinstance(term, GaussMarkov):
        if T is not None and T != term.T:
            raise InputError(
                f"T = {T:g} s, but the Gauss-Markov term of the model has {term.T:g} s: leave T out"
            )
        return term.q**2, term.T
    if T is None or not (math.isfinite(T) and T > 0):
        raise InputError(
            f"flicker needs T=, the correlation time in seconds that the filter gives it, not {T!r}"
        )
    return 2 * term.B**2 * math.log(2) / (math.pi * _PEAK**2 * T), T


def _left_out(model: NoiseModel) -> tuple[str, ...]:
    known = (White, Flicker, GaussMarkov, RandomWalk)
    return tuple(dict.fromkeys(t.type for t in model.terms if not isinstance(t, known)))


def _reference(reference: ArrayLike, rows: int) -> Array:
    reference_rate = np.asarray(reference, dtype=np.float64)
    if reference_rate.shape not in ((), (rows,)) or not np.isfinite(reference_rate).all():
        raise InputError(
            f"reference must be one finite rate, or one for each of the {rows} samples, not {reference_rate.shape}"
        )
    return np.array(np.broadcast_to(reference_rate, (rows,)))


def _signs(signs: ArrayLike | None, rows: int) -> Array | None:
    if signs is None:
        return None
    heading = np.asarray(signs, dtype=np.float64)
    if heading.shape != (rows,) or not np.isin(heading, (-1.0, 0.0, 1.0)).all():
        raise InputError(f"signs must be +1, -1 or 0 for each of the {rows} samples")
    return heading


def _mean(values: Array) -> float:
    present = values[np.isfinite(values)]
    return float(present.mean()) if len(present) else math.nan


def _cumulative(values: Array) -> Array:
    present = np.isfinite(values)
    count = np.cumsum(present)
    total = np.cumsum(np.where(present, values, 0.0))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _final(array: Array) -> Array:
    array.flags.writeable = False
    return array
