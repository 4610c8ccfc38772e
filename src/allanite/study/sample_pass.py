# SPDX-License-Identifier: BSD-3-Clause
"""What a study needs of the samples of a channel beside their curve, gathered in one pass."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.lazy_dataclasses import dataclass
from allanite.recording.health.survey import Probes
from allanite.recording.records import Recording
from allanite.study.overview import OverviewTally

if TYPE_CHECKING:
    from allanite.fitting.spectral.modes import PartMeans
    from allanite.noise.spectrum.periodogram import Cascade

__all__ = ["SamplePass"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SamplePass:
    """The tallies of one pass.

    Attributes
    ----------
    overview : OverviewTally
    probes : Probes
        Stretches that tell the law of the white noise.
    cascade : Cascade
        Periodograms for the spectrum.
    means : PartMeans
        The slowest movements, for its comparison with the curve.
    """

    overview: OverviewTally
    probes: Probes
    cascade: Cascade
    means: PartMeans

    @classmethod
    def of(cls, recording: Recording, name: str) -> SamplePass:
        """Read a channel once: a file that is decoded as it is read costs most of the time of a pass."""
        from allanite.fitting.spectral.modes import PartMeans
        from allanite.noise.spectrum.periodogram import Cascade, Rates

        n = recording.n_samples
        rates = Rates(recording, name)
        made = cls(
            overview=OverviewTally(recording, recording[name]),
            probes=Probes(n),
            cascade=Cascade(recording),
            means=PartMeans(n),
        )
        for start, samples in recording.blocks(name):
            made.overview.add(samples)
            made.probes.add(start, samples)
            block = rates(samples)
            made.cascade.feed(block)
            made.means.feed(block)
        return made
