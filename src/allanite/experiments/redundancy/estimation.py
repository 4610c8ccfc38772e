# SPDX-License-Identifier: BSD-3-Clause
"""combine(recording): several sensors of one kind as one, and what their disagreement tells.

Why constant weights. Any weights with W H = 1 pass what is measured unchanged, at every frequency and from the first
sample on; their noise is a sum of the terms of the sensors, which every other tool takes. The best weights depend on
the averaging time only where the sensors differ in the shape of their noise; a Kalman filter of all models would
change them over frequency, and starts with a transient that a fault repeats. So the weights are the best ones [1] for
one stated averaging time, and `loss` says what that costs at all others.

References
----------
.. [1] A. C. Aitken, Proc. R. Soc. Edinburgh 55 (1935) 42: C^-1 weights are the best linear unbiased ones.
.. [2] J. E. Potter, M. C. Suman, AGARDograph 224 (1977): parity of redundant sensors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.experiments.redundancy.combined import combined_model, combined_recording
from allanite.experiments.redundancy.fault_spans import to_the_sample
from allanite.experiments.redundancy.faults import Examination, examine
from allanite.experiments.redundancy.geometry import best_weights, checked_directions, parity_matrix, twins
from allanite.experiments.redundancy.means import WindowMeans, window_means
from allanite.experiments.redundancy.results import (
    CombinedSensors,
    ParitySeries,
    SensorFault,
    SharedNoise,
    WindowSeries,
    verdict_of,
)
from allanite.experiments.redundancy.shared import (
    AllanCovariance,
    allan_covariance,
    correlation_kept,
    pairs_of,
)
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, Quantisation, White
from allanite.noise.allan.degrees import chi_square_factors
from allanite.noise.given_models import models_of
from allanite.plain_files.counted import plural
from allanite.quantities.distributions import normal_quantile
from allanite.quantities.probabilities import require_probabilities
from allanite.recording.channel_names import for_shell
from allanite.recording.records import Kind, Recording

__all__ = ["combine", "measured_gain"]

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

#: Windows into which a record is divided for the parity, and for the Allan covariance; at least so many.
WINDOWS, FINE, FEWEST = 1000, 1 << 17, 32
#: Least samples of a window, for a sensor that stands still to be seen by it.
LEAST = 8
#: Degrees of freedom that a correlation needs to enter the weights: their error costs the variance (n - m)/KNOWN.
KNOWN = 50.0


def combine(
    recording: Recording,
    *,
    models: Mapping[str, NoiseModel] | NoiseModel,
    directions: ArrayLike | None = None,
    channels: Sequence[str] | None = None,
    averaging: float | None = None,
    rest: bool = True,
    window: float | None = None,
    false_alarm: float = 0.01,
    motion_error: float = 0.0,
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> CombinedSensors:
    """Combine sensors of one kind, and look for one that contradicts the others.

    Parameters
    ----------
    recording : Recording
        Rates or accelerations.
    models : NoiseModel, or mapping of channel name to NoiseModel
        Noise of each sensor; one model for all where they are alike.
    directions : array_like, shape (n, 3), optional
        Unit vectors along the sensitive axes; without them all sensors lie along one axis.
    channels : sequence of str, optional
        Channels to combine; by default all rates, or all accelerations.
    averaging : float, optional [s]
        Averaging time for which the weights are best. By default the time at which white noise falls to the slow noise,
        at most a sixteenth of the record.
    rest : bool
        The record is at rest: the noise that sensors share is measured on it and enters the weights. Otherwise the
        models alone do.
    window : float, optional [s]
        Window of the parity; by default a thousandth of the record.
    false_alarm : float
        Probability of any fault in a record without one.
    motion_error : float
        Standard uncertainty of scale factors (relative) and axes [rad], which motion turns into parity.
    confidence : float
        Confidence level of the intervals.
    progress : callable, optional
        Called with a fraction and words.

    Returns
    -------
    CombinedSensors
        A `Combination` with the recording of the combined axes.

    Raises
    ------
    InputError
        Channels of several kinds or of unknown unit, no redundancy, axes in a plane, no model for a channel, or a
        record of fewer than 32 windows.
    """
    advance = progress or (lambda fraction, what: None)
    names = _channels(recording, channels)
    noise = tuple(models_of(models, {name: recording[name].kind for name in names}).values())
    h = checked_directions(directions, len(names))
    _check(averaging, window, false_alarm, motion_error, confidence)
    setup = _Setup.of(recording, names, noise, h, averaging, window, rest)
    advance(0.1, "reading")
    means = window_means(recording, names, setup.window)
    _refuse_silent(means, names)
    fine = means if setup.fine == setup.window else window_means(recording, names, setup.fine)
    advance(0.4, "looking for faults")
    examination = examine(
        means,
        setup.parity,
        noise,
        setup.white_correlation(fine, np.zeros(len(means), dtype=np.bool_), means),
        names,
        false_alarm=false_alarm,
        extra=motion_error**2 * _signal(means, h),
    )
    advance(0.8, "combining")
    return _combination(
        recording, setup, means, fine, examination, false_alarm=false_alarm, confidence=confidence, rest=rest
    )


# -- what is asked for ------------------------------------------------------------------------------------------


def _channels(recording: Recording, wanted: Sequence[str] | None) -> tuple[str, ...]:
    able = (Kind.RATE, Kind.ACCELERATION)
    if wanted is None:
        kind = next((k for k in able if any(c.kind is k for c in recording.channels)), None)
        names = tuple(c.name for c in recording.channels if c.kind is kind)
    else:
        names = tuple(wanted)
    kinds = {recording[name].kind for name in names}
    if len(kinds) != 1 or not kinds <= set(able):
        has = ", ".join(f"{c.name} ({c.kind.value})" for c in recording.channels)
        raise InputError(
            f"combine takes sensors of one kind, rates or accelerations in known units, out of: {has}"
        )
    return names


def _check(
    averaging: float | None, window: float | None, false_alarm: float, motion_error: float, confidence: float
) -> None:
    for name, value in (("averaging", averaging), ("window", window)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} must be positive seconds, not {value!r}")
    require_probabilities(false_alarm=false_alarm, confidence=confidence)
    if not (math.isfinite(motion_error) and motion_error >= 0):
        raise InputError(f"motion_error must be finite and not negative, not {motion_error!r}")


def _refuse_silent(means: WindowMeans, names: tuple[str, ...]) -> None:
    """A sensor that repeats one value from end to end agrees with anything, and no parity tells that it is stuck."""
    levels = (level[~np.isnan(level)] for level in means.mean.T)
    silent = [
        name
        for name, level, frozen in zip(names, levels, means.frozen.T, strict=True)
        if frozen.any() and (level == level[0]).all()
    ]
    if silent:
        others = [name for name in names if name not in silent]
        raise InputError(
            f"one value throughout the record: {', '.join(silent)}. Check the wiring and the range, or combine the "
            f"others: --channels {for_shell(','.join(others))} (channels= in Python)"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Setup:
    names: tuple[str, ...]
    models: tuple[NoiseModel, ...]
    directions: Array
    parity: Array
    averaging: float
    window: int
    fine: int
    rest: bool

    @classmethod
    def of(
        cls,
        recording: Recording,
        names: tuple[str, ...],
        models: tuple[NoiseModel, ...],
        h: Array,
        averaging: float | None,
        window: float | None,
        rest: bool,
    ) -> _Setup:
        n = recording.n_samples
        size = max(LEAST, n // WINDOWS) if window is None else max(round(window * recording.rate), 1)
        if n // size < FEWEST:
            raise InputError(
                f"the record holds {plural(n // size, 'window')} of {size / recording.rate:g} s: parity needs {FEWEST}"
            )
        at = min(_reach(models), recording.duration / 16) if averaging is None else averaging
        if not recording.dt <= at <= recording.duration / 2:
            raise InputError(
                f"averaging {at:g} s: it must lie from one sample to half of the record of {recording.duration:g} s"
            )
        return cls(
            names=names,
            models=models,
            directions=h,
            parity=parity_matrix(h),
            averaging=float(at),
            window=size,
            fine=max(n // FINE, 1),
            rest=rest,
        )

    @property
    def typical(self) -> NoiseModel:
        """Of the sensors, that with the smallest deviation at the averaging time."""
        return min(self.models, key=lambda m: float(m.avar(self.averaging)))

    def measured(self, fine: WindowMeans, busy: NDArray[np.bool_], means: WindowMeans) -> AllanCovariance:
        """Allan covariance without the windows of a fault."""
        rows = np.minimum(np.arange(len(fine)) * fine.size // means.size, len(busy) - 1)
        still = np.where(busy[rows, None] | (fine.part < 0.5), np.nan, fine.mean)
        return allan_covariance(still, fine.dt, self.typical)

    def white_correlation(self, fine: WindowMeans, busy: NDArray[np.bool_], means: WindowMeans) -> Array:
        """At the length of a window: what the parity of windows feels of it."""
        if not self.rest:
            return np.eye(len(self.names))
        allan = self.measured(fine, busy, means)
        return correlation_kept(pairs_of(allan, means.dt, self.names, 0.95), self.names)


def _reach(models: Sequence[NoiseModel]) -> float:
    """Averaging time at which the slow noise of the sensors becomes as large as the white [s]; infinite without."""
    tau = np.geomspace(1e-3, 1e7, 601)
    white = sum(t.N**2 for m in models for t in m.terms if isinstance(t, White)) / tau
    slow = np.zeros_like(tau)
    for model in models:
        slow = slow + sum(t.avar(tau) for t in model.terms if not isinstance(t, (White, Quantisation)))
    ruled = slow >= white
    return float(tau[int(np.argmax(ruled))]) if ruled.any() else math.inf


def _signal(means: WindowMeans, h: Array) -> Array:
    """Square of what is measured, window by window, by least squares; shape (windows,)."""
    x = np.nan_to_num(means.mean) @ np.linalg.pinv(h).T
    return np.asarray((x**2).sum(axis=1))


# -- the result ---------------------------------------------------------------------------------------------------


def _combination(
    recording: Recording,
    setup: _Setup,
    means: WindowMeans,
    fine: WindowMeans,
    examination: Examination,
    *,
    false_alarm: float,
    confidence: float,
    rest: bool,
) -> CombinedSensors:
    faults = tuple(to_the_sample(fault, means, recording) for fault in examination.faults)
    busy = _busy(faults, means)
    pairs: tuple[SharedNoise, ...] = ()
    correlation = np.eye(len(setup.names))
    allan = None
    if rest:
        allan = setup.measured(fine, busy if not busy.all() else np.zeros_like(busy), means)
        known = allan.tau[allan.edf >= KNOWN]
        at = min(setup.averaging, float(known[-1]) if len(known) else float(allan.tau[0]))
        pairs = pairs_of(allan, at, setup.names, confidence)
        correlation = correlation_kept(pairs, setup.names)
    sd = np.sqrt([float(m.avar(setup.averaging)) for m in setup.models])
    covariance = np.outer(sd, sd) * correlation
    weights = best_weights(setup.directions, covariance)
    differences = _differences(means, setup.parity, busy)
    models = tuple(combined_model(setup.models, w, correlation) for w in weights)
    axes = _axes(recording[setup.names[0]].kind, weights.shape[0])
    left_out = _left_out(faults, recording.rate)
    combined = combined_recording(
        recording, setup.names, axes, setup.directions, covariance, differences, left_out
    )
    written = _written(combined, setup) if faults and allan is not None else None
    curves = _curves(
        setup, allan, weights, correlation, models, fine.dt, recording.duration, confidence, written
    )
    return CombinedSensors(
        verdict=verdict_of(faults),
        channels=setup.names,
        axes=axes,
        kind="rate" if recording[setup.names[0]].kind is Kind.RATE else "acceleration",
        directions=setup.directions,
        weights=weights,
        averaging=setup.averaging,
        differences=differences,
        shared=pairs,
        correlation=correlation,
        models=models,
        **curves,
        faults=faults,
        alike=tuple(tuple(setup.names[i] for i in group) for group in twins(setup.parity)),
        parity=ParitySeries(
            windows=tuple(
                WindowSeries(
                    length=scale * means.dt,
                    time=np.asarray((np.arange(len(chi2)) + 0.5) * scale * means.dt, dtype=np.float64),
                    statistic=chi2,
                )
                for scale, chi2 in examination.series.items()
            ),
            threshold=examination.threshold,
            dof=examination.dof,
        ),
        false_alarm=false_alarm,
        noise_ratio=examination.noise_ratio,
        unusual=examination.unusual,
        at_rest=rest,
        faults_everywhere=bool(busy.all()),
        confidence=confidence,
        rate=recording.rate,
        duration=recording.duration,
        source=recording.source,
        combined=combined,
    )


def _axes(kind: Kind, m: int) -> tuple[str, ...]:
    name = "gyro" if kind is Kind.RATE else "accel"
    return (name,) if m == 1 else tuple(f"{name}_{a}" for a in "xyz")


def _busy(faults: Sequence[SensorFault], means: WindowMeans) -> NDArray[np.bool_]:
    out = np.zeros(len(means), dtype=np.bool_)
    for f in faults:
        out[math.floor(f.since / means.dt + 1e-9) : math.ceil(f.stop / means.dt - 1e-9)] = True
    return out


def _differences(means: WindowMeans, parity: Array, busy: NDArray[np.bool_]) -> Array:
    """V' times the mean parity: what the sensors' constants contradict each other by; of least squares length."""
    use = ~np.isnan(means.mean).any(axis=1)
    quiet = use & ~busy
    rows = means.mean[quiet if quiet.any() else use]
    return np.asarray(parity.T @ (parity @ rows.mean(axis=0)))


def _left_out(faults: Sequence[SensorFault], rate: float) -> dict[str, list[tuple[int, int]]]:
    spans: dict[str, list[tuple[int, int]]] = {}
    for f in faults:
        if f.sensor is not None:  # the end is as uncertain as the beginning
            late = f.start - f.since if f.kind == "step" else 0.0
            begin, end = f.since * rate, (f.stop + late) * rate
            spans.setdefault(f.sensor, []).append((math.floor(begin + 1e-6), math.ceil(end - 1e-6)))
    return spans


def _written(combined: Recording, setup: _Setup) -> AllanCovariance:
    """Of the recording that is handed over, with its faults or what is left of them."""
    fine = window_means(combined, combined.names, setup.fine)
    return allan_covariance(np.where(fine.part < 0.5, np.nan, fine.mean), fine.dt, setup.typical)


def _curves(
    setup: _Setup,
    allan: AllanCovariance | None,
    weights: Array,
    correlation: Array,
    models: Sequence[NoiseModel],
    dt: float,
    duration: float,
    confidence: float,
    written: AllanCovariance | None,
) -> dict[str, Array]:
    """Everything over tau."""
    if allan is not None and written is not None:
        allan = allan.shortened(min(len(allan.tau), len(written.tau)))
        written = written.shortened(len(allan.tau))
    tau = (
        allan.tau
        if allan is not None
        else dt * 2.0 ** np.arange(int(math.log2(max(duration / dt / 4, 1))) + 1)
    )
    sd = np.sqrt(np.stack([m.avar(tau) for m in setup.models], axis=1))
    best = np.argmin(sd, axis=1)
    single = sd[np.arange(len(tau)), best]
    achieved = np.sqrt(np.einsum("mi,ki,ij,kj,mj->km", weights, sd, correlation, sd, weights))
    made = [best_weights(setup.directions, np.outer(s, s) * correlation) for s in sd]
    bound = np.sqrt(
        [[w @ (np.outer(s, s) * correlation) @ w for w in ws] for s, ws in zip(sd, made, strict=True)]
    )
    out = {
        "tau": tau,
        "predicted": np.sqrt(np.stack([m.avar(tau) for m in models], axis=1)),
        "single": single,
        "gain_predicted": single[:, None] / achieved,
        "loss": achieved / bound,
    }
    empty = np.full(achieved.shape, np.nan)
    names = ("measured", "lower", "upper", "gain", "gain_lower", "gain_upper")
    return {
        **out,
        **(
            measured_gain(allan, weights, best, confidence, written) if allan else dict.fromkeys(names, empty)
        ),
    }


def measured_gain(
    allan: AllanCovariance,
    weights: Array,
    best: NDArray[np.int64],
    confidence: float,
    written: AllanCovariance | None = None,
) -> dict[str, Array]:
    """Deviations of the combined axes, and how much smaller they are than those of the best sensor.

    Both come from the same windows: of ln gain the variance is (1 - r^2)/edf, r being the correlation of the two.
    After a fault the axes are those of the recording as `written`, of all windows, and the sensor is that of the
    windows without a fault, which are a part of them: (1/edf_sensor + 1/edf_axis)/2 - r^2/max(edf).
    """
    c, rows = allan.matrix, np.arange(len(allan.tau))
    joint = np.einsum("mi,kij,mj->km", weights, c, weights)
    alone = c[rows, best, best][:, None]
    cross = np.einsum("mi,kij->kmj", weights, c)[rows, :, best]
    r2 = np.clip(cross**2 / np.maximum(joint * alone, 1e-300), 0.0, 1.0)
    edf = allan.edf
    if written is not None:
        joint, edf = np.einsum("kmm->km", written.matrix), written.edf
    low, high = chi_square_factors(np.maximum(edf, 1e-3), confidence)
    gain = np.sqrt(alone / joint)
    variance = (1 / allan.edf + 1 / edf)[:, None] / 2 - r2 / np.maximum(allan.edf, edf)[:, None]
    spread = np.exp(normal_quantile(0.5 + confidence / 2) * np.sqrt(variance))
    deviation = np.sqrt(joint)
    return {
        "measured": deviation,
        "lower": deviation * low[:, None],
        "upper": deviation * high[:, None],
        "gain": gain,
        "gain_lower": gain / spread,
        "gain_upper": gain * spread,
    }
