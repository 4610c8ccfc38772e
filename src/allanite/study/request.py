# SPDX-License-Identifier: BSD-3-Clause
"""What is asked of a study, and how far it has come."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Literal

from numpy.typing import ArrayLike

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise.allan import AllanCurve, allan_curve
from allanite.recording.records import Recording

__all__ = ["Progress", "ProgressSteps", "Request"]

Progress = Callable[[float, str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Options of `allanite.study.characterization.characterize`, which describes them."""

    accept: Collection[str]
    method: str
    statistic: str
    taus: str | int | ArrayLike
    confidence: float
    temperature: str | Mapping[str, str] | None
    warm_up: Literal["model", "cut"] | None
    floor: Recording | None
    exclude: Sequence[tuple[float, float]]
    threads: int | None

    def __post_init__(self) -> None:
        if self.method not in ("moments", "likelihood"):
            raise InputError(f"method must be 'moments' or 'likelihood', not {self.method!r}")
        unknown = [
            name
            for name, asked in (
                ("a temperature", bool(self.temperature)),
                ("a modeled warm-up", self.warm_up == "model"),
                ("a floor", self.floor is not None),
                ("exclude", bool(self.exclude)),
            )
            if asked
        ]
        if self.method == "likelihood" and unknown:
            raise InputError(
                f"the fit of the samples (likelihood) does not support {' or '.join(unknown)}: leave that "
                "out, or fit the curve (moments)"
            )

    @property
    def shows_what_is_fitted(self) -> bool:
        """The curve that is shown is the one that is fitted."""
        return self.statistic == "oadev"

    @property
    def environment(self) -> bool:
        """Effects of the environment are asked for."""
        return self.temperature is not None or self.warm_up is not None

    @property
    def thermometers(self) -> frozenset[str]:
        """Channels of the temperature."""
        if isinstance(self.temperature, str):
            return frozenset({self.temperature})
        return frozenset((self.temperature or {}).values())

    def curves(
        self, recording: Recording, progress: Callable[[float], None] | None = None
    ) -> tuple[AllanCurve, AllanCurve]:
        """The curve that is shown and the one that is fitted; one object where they are the same."""
        shown = allan_curve(
            recording,
            statistic=self.statistic,
            taus=self.taus,
            confidence=self.confidence,
            threads=self.threads,
            progress=progress,
        )
        if self.shows_what_is_fitted:
            return shown, shown
        return shown, allan_curve(recording, taus="octave", confidence=self.confidence, threads=self.threads)


class ProgressSteps:
    """Fractions of the whole work, made from fractions of its parts."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self._text = ""

    def __call__(self, fraction: float, text: str = "") -> None:
        self._text = text or self._text
        if self._progress is not None:
            self._progress(fraction, self._text)

    def part(self, start: float, stop: float) -> Callable[[float], None]:
        return lambda fraction: self(start + (stop - start) * min(max(fraction, 0.0), 1.0))
