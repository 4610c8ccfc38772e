# SPDX-License-Identifier: BSD-3-Clause
"""What the samples of a record show that a sum of Gaussian noise terms does not hold.

Heavy tails of the white noise enter the interval of N (`allanite.fitting.tails`). Spectral lines that stay in the
record, and what the health checks find, are named: each may be taken for a term.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from allanite.fitting.lines_left_in import LineLeftIn, spectral_lines, with_lines_left_in
from allanite.fitting.tails import with_tails
from allanite.fitting.verdict import with_fact
from allanite.noise import NoiseModel, Sinusoid
from allanite.noise.allan import AllanCurve
from allanite.recording.health.examination import check
from allanite.recording.health.finding import Finding, Severity
from allanite.recording.health.tails import TailLaw, Tails, law_of
from allanite.recording.records import Recording

__all__ = ["screened", "unscreened"]

_LINE = "spectral_line"
#: Share of white noise in the variance at the shortest lag from which on the tails of the samples are its own.
_MOSTLY = 0.7


def screened(
    model: NoiseModel,
    recording: Recording,
    name: str,
    findings: Sequence[Finding] | None = None,
    *,
    lines_named: bool = False,
) -> NoiseModel:
    """A model that was fitted to the samples of a channel, with what they show beside noise.

    The codes of the findings stand in `goodness` under "findings", and in the verdict.

    Parameters
    ----------
    findings : sequence of Finding, optional
        What `check` finds in the channel, where that is known.
    lines_named : bool
        The fit was given the frequencies of lines, and looked for no others.
    """
    alone = recording.select(name)
    missing = sum(int(np.isnan(samples).sum()) for _, samples in alone.blocks(name))
    model = with_tails(model, law_of(alone, name), alone.n_samples - missing)
    findings = check(alone) if findings is None else findings
    codes = [f.code for f in findings if f.severity is not Severity.INFO]
    if lines_named:
        model = with_lines_left_in(model, _lines_beside(alone, model))
    codes += [_LINE] if "lines_left_in" in model.goodness else []
    if not codes:
        return model
    names = list(dict.fromkeys(codes))
    text = f" Found in the samples: {', '.join(names)} (see `allanite info`)."
    return with_fact(model, {"findings": names}, text)


def unscreened(model: NoiseModel, curve: AllanCurve) -> NoiseModel:
    """A model that was fitted to a one-channel curve, with what is known of its samples and what is not.

    Heavy tails are held by the interval of N where white noise is most of the variance at the shortest lag. A sine near
    half the sample rate averages out as quantization does: "unseen" of `goodness`.
    """
    kurtosis = curve.excess_kurtosis[0]
    if kurtosis > 0.0 and _mostly_white(model, curve):
        present = curve.n_samples - int(np.diff(curve.missing[0], axis=1).sum())
        model = with_tails(model, Tails(law=TailLaw.HEAVY, samples=present, kurtosis=kurtosis), present)
        text = f" The samples have heavy tails (excess kurtosis {kurtosis:.2g}), which the interval of N includes."
        model = with_fact(model, {"findings": ["heavy_tails"]}, text)
    if not any(e.symbol == "Q" and e.supported for m in model.families for e in m.estimates):
        return model
    text = (
        " A spectral line near half the sample rate bends a curve like quantization; only the samples "
        "can distinguish them."
    )
    return with_fact(model, {"unseen": [_LINE]}, text)


def _mostly_white(model: NoiseModel, curve: AllanCurve) -> bool:
    white = model.estimate("N")
    shortest = float(curve.tau[0] * curve.variance[0, 0])
    return white is not None and white.value is not None and white.value**2 > _MOSTLY * shortest


def _lines_beside(recording: Recording, model: NoiseModel) -> tuple[LineLeftIn, ...]:
    """Spectral lines of a channel that the model does not hold."""
    held = [term.frequency for term in model.terms if isinstance(term, Sinusoid)]
    return tuple(
        LineLeftIn(frequency=line.frequency, note="it was not asked for")
        for line in spectral_lines(recording, recording.names[0])
        if all(abs(line.frequency - f) > 2 * line.width for f in held)
    )
