# SPDX-License-Identifier: BSD-3-Clause
"""What a study says of the environment: findings, so that nothing is taken off and nothing is left in silently."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.recording.health.finding import Finding, Severity, finding
from allanite.stability.environment.results import EnvironmentEstimate

__all__ = ["remarks"]


def remarks(found: EnvironmentEstimate) -> Iterator[Finding]:
    """Findings about one channel."""
    name, n = found.channel, found.residual.n_samples
    if found.taken_off:
        most = 0.0 if found.correction is None else float(found.correction.share.max())
        yield finding(
            "environment_taken_off",
            f"{name}: the noise model is that of the residual; taken off: {_listed(found)} (up to {most:.0%} of the "
            "Allan variance)",
            severity=Severity.INFO,
            channel=name,
            count=n,
        )
    if found.thermometer is not None and found.verdict != "resolved":
        yield finding(
            "temperature_not_resolved",
            f"{name}: the effect of the temperature {found.thermometer.channel} is {found.verdict}: {found.reason}",
            severity=Severity.WARNING,
            channel=name,
            count=n,
        )
    if found.hysteresis is not None and found.hysteresis.status == "found":
        yield finding(
            "hysteresis", f"{name}: {found.hysteresis.says}", severity=Severity.WARNING, channel=name, count=n
        )
    warm = found.warm_up
    if warm.found:
        done = {
            "modelled": "modelled and taken off",
            "cut": f"cut: the first {warm.cut or 0:.4g} s are not used",
        }
        yield finding(
            "warm_up",
            f"{name}: {warm.says}; {done.get(warm.action, 'left in the record')}",
            severity=Severity.WARNING if warm.action == "left in" else Severity.INFO,
            channel=name,
            count=n,
        )


def _listed(found: EnvironmentEstimate) -> str:
    names = [n for n in found.taken_off if not n.endswith("time constant")]
    return ", ".join(names)
