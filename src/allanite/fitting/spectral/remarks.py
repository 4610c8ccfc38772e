# SPDX-License-Identifier: BSD-3-Clause
"""What a spectrum says about a channel, as findings: its lines, its filter, and whether the curve's model holds."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.errors import DataQualityError
from allanite.fitting.spectral.agreement import disagreement
from allanite.fitting.spectral.modes import PartMeans
from allanite.fitting.spectral.ordinates import ordinates_of
from allanite.noise import NoiseModel
from allanite.noise.spectrum.results import Spectrum
from allanite.recording.health.finding import Finding, Severity, finding, plural
from allanite.recording.records import Recording

__all__ = ["agreement_findings", "spectral_findings"]

_NAMED = 5  # lines that a message names
_TRIFLE = 0.05  # relative change of a coefficient that decides nothing, however sure it is


def spectral_findings(spectrum: Spectrum, reasons: Sequence[str], name: str) -> list[Finding]:
    """Lines and filter of a channel.

    Parameters
    ----------
    spectrum : Spectrum
    reasons : sequence of str
        Per lag of the fitted curve: why it is kept out, "" where it is not.
    name : str
    """
    findings = []
    if spectrum.lines:
        steady = sum(line.stable for line in spectrum.lines)
        message = f"{name}: spectral line{'s' if len(spectrum.lines) > 1 else ''} at {_listed(spectrum)}"
        if steady:
            whose = "it is" if len(spectrum.lines) == 1 else f"{steady} of them are"
            message += f"; {whose} steady: removed before the fit, and a sinusoid of the model"
            message += "s" if steady > 1 else ""
        if steady < len(spectrum.lines):
            lags = sum("line" in r for r in reasons)
            message += f"; {plural(lags, 'lag')} excluded from the fit" if lags else "; no lag is bent by it"
        findings.append(
            finding(
                "spectral_line", message, severity=Severity.WARNING, channel=name, count=len(spectrum.lines)
            )
        )
    if spectrum.corner is not None:
        lags = sum("low-pass" in r for r in reasons)
        findings.append(
            finding(
                "band_limited",
                f"{name}: the density falls above {spectrum.corner:.3g} Hz (the sensor's own filter); "
                f"{plural(lags, 'lag')} excluded from the fit",
                severity=Severity.INFO,
                channel=name,
                count=lags,
            )
        )
    return findings


def _listed(spectrum: Spectrum) -> str:
    listed = ", ".join(f"{line.frequency:.4g} Hz" for line in spectrum.lines[:_NAMED])
    more = len(spectrum.lines) - _NAMED
    return listed + (f" and {more} more" if more > 0 else "")


def agreement_findings(
    model: NoiseModel, recording: Recording, spectrum: Spectrum, means: PartMeans | None = None
) -> list[Finding]:
    """A finding where the spectrum of a channel does not know the model of its curve.

    Parameters
    ----------
    model : NoiseModel
        Fitted to the Allan curve.
    recording : Recording
        What it was fitted to.
    spectrum : Spectrum
        Of the same samples, log-binned.
    means : PartMeans, optional
        Of the same samples, where another pass has made them.
    """
    try:
        parted = disagreement(model, ordinates_of(recording, spectrum, means))
    except DataQualityError:
        return []
    if parted is None:
        return []
    return [
        finding(
            "lag_and_frequency_disagree",
            f"{spectrum.channel}: {parted.words}",
            severity=Severity.WARNING if parted.size > _TRIFLE else Severity.INFO,
            channel=spectrum.channel,
            count=1,
        )
    ]
