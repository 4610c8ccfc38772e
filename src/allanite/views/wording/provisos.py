# SPDX-License-Identifier: BSD-3-Clause
"""What a reader of noise coefficients must know besides: a term that is needed but open, values that the log repeats,
contaminated noise, the sensor's bandwidth, the aperture of the meter, the error of the scale factor.

And what a run lacks, and how it was recorded.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from allanite.fitting.contamination import Contamination
from allanite.noise import NoiseModel
from allanite.noise.quick_terms import with_quick_terms_white
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import interval, number
from allanite.quantities.quantity import Quantity
from allanite.recording.sample_hold import HeldSamples
from allanite.study.results import Aliasing, ChannelModels, ChannelStudy

__all__ = ["provisos", "scale_proviso"]

#: Symbols of slow noise.
_SLOW = {"B", "T", "sigma", "sigma_2", "K", "R"}
#: Slow terms beside which others may be needed, by the symbol of their amplitude.
_RESOLVED = {"B": "B", "sigma": "the Gauss-Markov term", "K": "K", "R": "R"}


def provisos(channels: Iterable[ChannelModels]) -> list[str]:
    """One sentence for each kind of proviso, with the channels that it is true of."""
    by_sentence: dict[str, list[str]] = {}
    for channel in channels:
        for sentence in _provisos(channel):
            by_sentence.setdefault(sentence, []).append(channel.name)
    return [f"{', '.join(names)}: {sentence}" for sentence, names in by_sentence.items()]


def _provisos(channel: ChannelModels) -> Iterator[str]:
    if channel.models:
        yield from _needed(channel.models[0])
    if isinstance(channel, ChannelStudy):
        yield from _bandwidth(channel)
        if channel.held is not None:
            yield _held(channel.held)
        if channel.contamination is not None:
            yield _contamination(channel.contamination, channel)
        if channel.aliasing is not None:
            yield _aliasing(channel.aliasing)
    if channel.models:
        yield from scale_proviso(channel.models[0])
    if channel.models and channel.kind in ("phase", "frequency"):
        yield _CLOCK


def _needed(model: NoiseModel) -> Iterator[str]:
    """Limits that must not be read as "no slow noise": one of the terms is there, and which one is open."""
    needed = [e.symbol for e in model.estimates if e.needed]
    if needed:
        slow = _SLOW.issuperset(needed)
        shown = {e.symbol for e in model.estimates if slow and e.supported}
        resolved = [name for symbol, name in _RESOLVED.items() if symbol in shown]
        what = "Low-frequency noise" if slow else "Noise beyond the resolved terms"
        what += f" besides {' and '.join(resolved)}" if resolved else ""
        terms = "of these" if resolved else "term"
        yield (
            f"{what} is present, but the record is too short to tell which term causes it "
            f"({' or '.join([*needed, 'a similar term'])}): each {terms} is given as an upper limit."
        )


def _bandwidth(channel: ChannelStudy) -> Iterator[str]:
    """N that longer averaging times see, where a Gauss-Markov term of a few samples is beside that of the table."""
    for model in channel.models[:1]:
        white = with_quick_terms_white(model, channel.curve.dt)
        N = white.estimate("N")
        if white is not model and N is not None and N.value is not None:
            unit, factor = display_unit(channel.kind, "N", channel.unit)
            value, low, high = interval(N.value / factor, N.lower / factor, N.upper / factor)
            yield (
                f"N is {value} [{low}, {high}] {unit} for averaging times well above the Gauss-Markov term, which is "
                "the sensor's bandwidth. Exports use this value; the table shows the white noise alone."
            )


def _held(held: HeldSamples) -> str:
    rate, log = (f"{value:.6g} Hz" for value in (held.rate, held.log_rate))
    return f"each value was used once, at the sensor's rate of {rate}; the log runs at {log}."


def _contamination(contamination: Contamination, channel: ChannelModels) -> str:
    """N with and without the contaminated samples, each with its interval."""
    unit, factor = display_unit(channel.kind, "N", channel.unit)

    def written(n: Quantity) -> str:
        value, low, high = interval(n.value / factor, n.lower / factor, n.upper / factor)
        return f"{value} [{low}, {high}] {unit}"

    return (
        f"N is {written(contamination.N)} for all samples and {written(contamination.N_without)} without the "
        f"{number(100 * contamination.share, 2)} % that scatter {number(contamination.ratio, 2)} times as much. "
        "The first interval includes their scatter."
    )


def _aliasing(aliasing: Aliasing) -> str:
    aperture, interval = (f"{value:.6g} s" for value in (aliasing.aperture, aliasing.interval))
    return (
        f"N is that of the samples. Each averages {aperture} of its {interval}: if the noise of the sensor is white "
        f"far beyond 1/{aperture}, its own N is {number(aliasing.factor, 4)} = √({interval}/{aperture}) times smaller "
        "(aliasing). No result was divided by it."
    )


def scale_proviso(model: NoiseModel) -> Iterator[str]:
    """What the intervals of a fitted model hold of the scale factor; nothing where none is stated."""
    if model.scale_uncertainty is not None:
        yield (
            "the intervals include the scale factor's standard uncertainty of "
            f"{number(100 * model.scale_uncertainty, 2)} "
            "%, common to all amplitudes, in quadrature with the statistical uncertainty. The band of the "
            "curve does not include it."
        )


#: What the names of a clock's terms are, and which of them a fit does not have.
_CLOCK = (
    "WPM, WFM, FFM, RWFM: white phase, white, flicker and random-walk frequency noise, of fractional frequency. "
    "Flicker phase noise (FPM) is not a term of the fit: the Allan deviation shows it as WPM; "
    "`--statistic mdev` of `allanite allan` distinguishes them (slope -3/2 for WPM, -1 for FPM)."
)
