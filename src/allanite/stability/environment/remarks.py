# SPDX-License-Identifier: BSD-3-Clause
"""What a study says of the environment: findings, so that nothing is removed and nothing is left in silently."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.recording.health.finding import Finding, Severity, finding
from allanite.stability.environment.results import EnvironmentEstimate, WarmUp

__all__ = ["remarks", "warm_up_remark"]


def remarks(estimate: EnvironmentEstimate) -> Iterator[Finding]:
    """Findings about one channel."""
    name, n = estimate.channel, estimate.residual.n_samples
    if estimate.taken_off:
        most = 0.0 if estimate.correction is None else float(estimate.correction.share.max())
        yield finding(
            "environment_taken_off",
            f"{name}: the noise model describes the residual; removed: {_listed(estimate)} (up to {most:.0%} of the "
            "Allan variance)",
            severity=Severity.INFO,
            channel=name,
            count=n,
        )
    if estimate.thermometer is not None and estimate.verdict != "resolved":
        yield finding(
            "temperature_not_resolved",
            f"{name}: the effect of the temperature {estimate.thermometer.channel} is {estimate.verdict}: "
            f"{estimate.reason}",
            severity=Severity.WARNING,
            channel=name,
            count=n,
        )
    if estimate.hysteresis is not None and estimate.hysteresis.status == "found":
        yield finding(
            "hysteresis",
            f"{name}: {estimate.hysteresis.status.words}",
            severity=Severity.WARNING,
            channel=name,
            count=n,
        )
    if estimate.warm_up.found:
        yield warm_up_remark(name, estimate.warm_up, n)


def warm_up_remark(name: str, warm: WarmUp, n_samples: int) -> Finding:
    """The finding of a warm-up that is there."""
    done = {
        "modelled": "modeled and removed",
        "cut": f"cut: the first {warm.cut or 0:.4g} s are not used",
    }
    return finding(
        "warm_up",
        f"{name}: {warm.says}; {done.get(warm.action, 'left in the record')}",
        severity=Severity.WARNING if warm.action == "left in" else Severity.INFO,
        channel=name,
        count=n_samples,
    )


def _listed(estimate: EnvironmentEstimate) -> str:
    names = [n for n in estimate.taken_off if not n.endswith("time constant")]
    return ", ".join(names)
