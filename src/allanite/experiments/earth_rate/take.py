# SPDX-License-Identifier: BSD-3-Clause
"""A turned record as blocks, and the columns of its regression: Earth, level, and what decays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.reversals import Reversals
from allanite.experiments.reversals.sides import part_seen
from allanite.filtering.block_means import BlockMeans, block_means, longest_block
from allanite.filtering.regression import LEVEL, Regression, regress
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, White
from allanite.recording.records import Recording, Sampling

__all__ = ["RATE", "TIME_CONSTANT", "Take", "Transient"]

Array = NDArray[np.float64]

RATE = "rate"
"""Name of the coefficient that is wanted."""
TIME_CONSTANT = ", time constant"
"""End of the name of a coefficient that stands for the error of a time constant."""

#: Blocks in a record without turns.
BLOCKS_AT_REST = 4000
#: Most blocks: beyond them the blocks grow.
MOST_BLOCKS = 200_000
#: Time constants that are tried for the rotation that settles after a turn, and for the warm-up [s].
SETTLING = (1.0, 3.0, 10.0, 30.0)
WARM_UP = (60.0, 180.0, 600.0, 1800.0, 5400.0)
#: Most rows of the running estimate.
CHECKPOINTS = 400


@dataclass(frozen=True, slots=True)
class Transient:
    """An exponential that the noise model does not know: a warm-up, or a rotation that settles after each turn.

    Attributes
    ----------
    kind : str
    T : float [s]
        Time constant.
    fitted : bool
        T was fitted to this very record: its error is allowed for, to first order, by the derivative to T as a
        second column.
    """

    kind: Literal["warm-up", "settling"]
    T: float
    fitted: bool = False

    @property
    def name(self) -> str:
        """With the time constant."""
        return f"{self.kind} {self.T:.3g} s"

    def columns(self, take: Take) -> dict[str, Array]:
        """Since the beginning of the record; or since each turn, in the direction of the turn."""
        warms = self.kind == "warm-up"
        age = take.blocks.time if warms else take.age
        decay = np.exp(-age / self.T) * (1.0 if warms else np.nan_to_num(take.sign))
        if not self.fitted:
            return {self.name: decay}
        slope = np.where(np.isfinite(age), age, 0.0) / self.T * decay
        return {self.name: decay, self.name + TIME_CONSTANT: slope}


@dataclass(frozen=True, slots=True, kw_only=True)
class Take:
    """A turned record as blocks, and the columns of its regression."""

    blocks: BlockMeans
    reversals: Reversals
    recording: Recording
    channel: str
    latitude: float
    temperature: str | None
    model: NoiseModel | None

    @classmethod
    def of(
        cls,
        recording: Recording,
        channel: str,
        reversals: Reversals,
        latitude: float,
        temperature: str | None,
        *,
        model: NoiseModel | None,
        finer: int = 1,
    ) -> Take:
        """Blocks so short that nothing is lost in noise of this model, or `finer` times shorter still."""
        spans = np.array([(d.start, d.stop) for d in reversals.dwells], dtype=np.int64).reshape(-1, 2)
        size = max(_block_size(spans, recording, model) // finer, 1)
        blocks = block_means(recording, channel, size, spans)
        if not (blocks.span >= 0).any():
            raise InputError(
                f"channel {channel!r} has no usable sample: {len(spans)} dwells of {recording.duration:g} s"
            )
        return cls(
            blocks=blocks,
            reversals=reversals,
            recording=recording,
            channel=channel,
            latitude=latitude,
            temperature=temperature,
            model=model,
        )

    def with_dead_time(self, seconds: float) -> Take:
        """The same record with other dwells."""
        again = self.reversals.with_dead_time(seconds)
        return Take.of(self.recording, self.channel, again, self.latitude, self.temperature, model=self.model)

    @property
    def projection(self) -> float:
        """Part of the Earth's rotation that the axis sees to the north, or up."""
        return part_seen(self.reversals.first, self.latitude)

    @property
    def sampling(self) -> Sampling:
        """Means over a block are interval means, but for a block of one point sample."""
        channel_sampling = self.recording[self.channel].sampling
        return channel_sampling if round(self.blocks.dt * self.recording.rate) == 1 else "mean"

    @property
    def sign(self) -> Array:
        """Direction of each block; NaN where it is not known or nothing was measured."""
        signs = np.array([d.sign for d in self.reversals.dwells] + [0], dtype=np.float64)[self.blocks.span]
        return np.where(signs == 0, np.nan, signs)

    @property
    def age(self) -> Array:
        """Time since the last turn [s]; infinite before the first."""
        ends = np.array([t.stop for t in self.reversals.turns], dtype=np.float64) / self.recording.rate
        if not len(ends):
            return np.full(self.blocks.size, np.inf)
        last = np.searchsorted(ends, self.blocks.time, side="right") - 1
        return np.where(last >= 0, self.blocks.time - ends[np.maximum(last, 0)], np.inf)

    def warmth(self, channel: str) -> Array:
        """A companion channel in the blocks, less its mean; where it is missing it is taken as its mean."""
        spans = np.array([(d.start, d.stop) for d in self.reversals.dwells], dtype=np.int64).reshape(-1, 2)
        means = block_means(self.recording, channel, round(self.blocks.dt * self.recording.rate), spans).mean
        return np.nan_to_num(means - np.nanmean(means))

    def columns(self) -> tuple[Array, tuple[str, ...]]:
        """Rate and level; with a temperature, that too. Without reversals the rate has no sign: +1 is taken."""
        sign = self.sign if self.reversals.turns else np.where(self.blocks.span >= 0, 1.0, np.nan)
        table: list[Array] = [sign * self.projection, np.ones(self.blocks.size)]
        names: tuple[str, ...] = (RATE, LEVEL)
        if self.temperature is not None:
            table.append(self.warmth(self.temperature))
            names = (*names, self.temperature)
        return np.column_stack(table), names

    def design(self, decays: Sequence[Transient]) -> tuple[Array, tuple[str, ...]]:
        """The columns and those of the decays, with their names."""
        table, names = self.columns()
        more = {name: column for decay in decays for name, column in decay.columns(self).items()}
        return np.column_stack([table, *more.values()]), (*names, *more)

    def fit(
        self, model: NoiseModel, decays: Sequence[Transient] = (), *, running: bool = False
    ) -> Regression:
        """The regression; with a running estimate at the `checkpoints` where it is wanted."""
        table, names = self.design(decays)
        return self.regress(table, names, model, running=running)

    def regress(
        self, table: Array, names: tuple[str, ...], model: NoiseModel, *, running: bool = False
    ) -> Regression:
        """Any columns on these blocks."""
        return regress(
            self.blocks.mean,
            table,
            model,
            dt=self.blocks.dt,
            names=names,
            counts=self.blocks.part,
            sampling=self.sampling,
            checkpoints=self.checkpoints().tolist() if running else (),
        )

    def checkpoints(self) -> NDArray[np.int64]:
        """Numbers of blocks by which dwells end, or some of them where there are very many."""
        stops = [d.stop for d in self.reversals.dwells]
        rows = np.minimum(np.ceil(np.array(stops) / self.recording.rate / self.blocks.dt), self.blocks.size)
        every = max(len(rows) // CHECKPOINTS, 1)
        return rows[::-1][::every][::-1].astype(np.int64)

    # -- what the noise model does not know ---------------------------------------------------------------

    def offered(self, kind: Literal["warm-up", "settling"]) -> list[Transient]:
        """Decays that make sense in this record."""
        if kind == "settling":
            return [Transient(kind, T) for T in SETTLING] if self.reversals.turns else []
        return [Transient(kind, T) for T in WARM_UP if T < 2 * self.recording.duration]

    def best(self, model: NoiseModel, kind: Literal["warm-up", "settling"]) -> list[Transient]:
        """The decay that leaves the smallest residuals, its time constant refined; none where none is offered."""
        offered = self.offered(kind)
        if not offered:
            return []
        from scipy.optimize import minimize_scalar

        def cost(log_T: float) -> float:
            return self.fit(model, [Transient(kind, math.exp(log_T))]).chi2

        start = min(offered, key=lambda decay: cost(math.log(decay.T)))
        middle = math.log(start.T)
        optimum = minimize_scalar(
            cost, bounds=(middle - 1.3, middle + 1.3), method="bounded", options={"xatol": 1e-3}
        )
        return [Transient(kind, math.exp(float(optimum.x)), fitted=True)]


def _block_size(spans: NDArray[np.int64], recording: Recording, model: NoiseModel | None) -> int:
    """Samples in a block, by the shorter ones of the dwells. Unknown noise is taken for white."""
    if len(spans) <= 1:
        size = recording.n_samples // BLOCKS_AT_REST
    else:
        dwell = float(np.quantile(spans[:, 1] - spans[:, 0], 0.2)) / recording.rate
        size = int(longest_block(model or NoiseModel.of(White(N=1.0)), dwell) * recording.rate)
    return max(size, -(-recording.n_samples // MOST_BLOCKS), 1)
