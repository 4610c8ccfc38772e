# SPDX-License-Identifier: BSD-3-Clause
"""NoiseModel from a curve or from a recording: one file or folder per estimator.

``slopes``      the seed's reading of the curve, for comparison.
``moments``     the fit of the curve: full covariance, non-negative terms, sets by test inversion.
``families``    its sums of terms; ``sets`` their sets; ``objective`` and ``design`` its numerics.
``inversion``   the ends of confidence sets by test inversion, for every fit.
``likelihood``  the fit of the samples themselves.
``spectral``    the fit of their spectrum.
``selection``   which sums of terms a record may have, with their weights.
``samples``     what samples show that no sum of terms holds; ``tails`` heavy tails in the interval of N;
``lines_left_in`` spectral lines that are no term of the model.
``instrument``  a sensor seen through an instrument whose own noise was recorded too.
``rivals``      flicker or Gauss-Markov; ``undecided`` where it cannot be told; ``stand_ins`` what else a curve allows.
``estimates``   from sets to estimates; ``verdict`` what is supported, in words.
``scale``       the uncertainty of the scale factor in the intervals.
``advice``      how long to record.
``instrument_floor``  the noise of an instrument removed; ``overbound`` a model that lies above the sensor;
``model_difference``  two models beside each other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.errors import InputError
from allanite.plain_files.loggers import logger_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from allanite.noise import NoiseModel
    from allanite.noise.allan import AllanCurve
    from allanite.recording.health.finding import Finding
    from allanite.recording.records import Channel, Recording

__all__ = ["fit"]

_LOG = logger_of(__name__)
_OF_CURVE = ("moments", "slopes")
_OF_RECORDING = ("likelihood", "spectral")


def fit(
    measured: AllanCurve | Recording,
    *,
    method: str | None = None,
    exclude: ArrayLike | None = None,
    confidence: float = 0.95,
    floor: AllanCurve | None = None,
    screen: bool | Sequence[Finding] = True,
    **options: Any,
) -> NoiseModel:
    """Fit a noise model to the Allan curve of one channel, or to the samples of one channel.

    Parameters
    ----------
    measured : AllanCurve or Recording
        A curve of one channel (``curve["x"]`` selects it), or a recording.
    method : str, optional
        For a curve: "moments" (the default) gives intervals and upper limits; "slopes" reads values off straight
        lines, without either, for comparison with the literature. For a recording: "likelihood" (the default), within
        a few percent of the Cramér-Rao bound; "spectral", a fit to the spectrum.
    exclude : array_like of bool, shape (n_lags,), optional
        Lags of the curve to exclude.
    confidence : float
        Confidence level of the intervals.
    floor : AllanCurve, optional
        For "moments": the curve of the instrument alone, on the interval and in the unit of `measured`
        (`allanite.fitting.instrument_floor.floor_of`). The model is that of the sensor without the instrument.
    screen : bool or sequence of Finding
        For a recording: check the samples for heavy tails and faults, and report these and the lines that the model
        does not include; see `allanite.fitting.samples`. For a curve: allow for the heavy tails recorded in it, and
        state what only samples can show. False skips the check; findings of `allanite.check` replace it.
    **options
        For a recording: `channel`, `terms` (the letters to fit), and the options of the method: `lines` [Hz], `engine`
        and `block` of `allanite.fitting.likelihood.fit_likelihood`, or those of
        `allanite.fitting.spectral.fit_spectral`.

    Returns
    -------
    NoiseModel
        With `estimates`, `covariance`, `goodness`, and `alternative` if the record cannot distinguish the two families.
        If the channel states the uncertainty of its scale factor, the intervals include it; see
        `allanite.fitting.scale`.

    Raises
    ------
    InputError
        Neither a curve nor a recording, an unknown method or one for the other kind of input, several channels, or
        another statistic than oadev.
    DataQualityError
        No noise, or too few lags or samples.
    FitError
        No optimum was found.
    """
    from allanite.fitting.samples import screened, unscreened
    from allanite.fitting.scale import with_scale_uncertainty
    from allanite.recording.records import Recording

    _check_kind(measured)
    names = ", ".join(channel.name for channel in measured.channels)
    method = method or (_OF_RECORDING if isinstance(measured, Recording) else _OF_CURVE)[0]
    _LOG.info("fit of %s by %s begins", names, method)
    if isinstance(measured, Recording):
        if exclude is not None:
            raise InputError("exclude= leaves out lags of a curve; it does not apply to a recording")
        if floor is not None:
            raise InputError(
                "floor= goes with the curve of a recording: fit(allan_curve(recording)[name], floor=...)"
            )
        model = _fit_recording(measured, method, {**options, "confidence": confidence})
        channels = [measured[options["channel"]]] if options.get("channel") else _noisy(measured)
        if screen is not False and len(channels) == 1:
            findings = None if screen is True else screen
            named = not isinstance(options.get("lines", "auto"), str)
            model = screened(model, measured, channels[0].name, findings, lines_named=named)
    else:
        model = _fit_curve(measured, method, exclude, confidence, floor, options)
        model = unscreened(model, measured) if screen is not False else model
        channels = list(measured.channels)
    model = with_scale_uncertainty(model, channels[0].scale_uncertainty if len(channels) == 1 else None)
    _LOG.info("fit of %s by %s: %s", names, method, model)
    return model


def _check_kind(measured: object) -> None:
    from allanite.noise.allan import AllanCurve
    from allanite.recording.records import checked_recording

    if not isinstance(measured, AllanCurve):
        checked_recording(measured, "fit", "an AllanCurve or a Recording")


def _noisy(recording: Recording) -> list[Channel]:
    return [c for c in recording.channels if c.kind.noise_bearing]


def _fit_curve(
    curve: AllanCurve,
    method: str,
    exclude: ArrayLike | None,
    confidence: float,
    floor: AllanCurve | None,
    options: dict[str, Any],
) -> NoiseModel:
    _check(
        method, _OF_CURVE, "an Allan curve", _OF_RECORDING, "the recording itself: fit(recording, method=...)"
    )
    if options:
        raise InputError(f"the fit of a curve takes no {', '.join(options)}")
    if method == "slopes":
        if floor is not None:
            raise InputError("the slope reading takes no floor; the moment fit does")
        from allanite.fitting.slopes import read_slopes

        return read_slopes(curve, exclude=exclude)
    from allanite.fitting.moments import fit_moments

    return fit_moments(curve, exclude=exclude, confidence=confidence, floor=floor)


def _fit_recording(recording: Recording, method: str, options: dict[str, Any]) -> NoiseModel:
    _check(
        method, _OF_RECORDING, "a recording", _OF_CURVE, "its curve: fit(allan_curve(recording), method=...)"
    )
    fit_it: Any
    if method == "spectral":
        from allanite.fitting.spectral.estimation import fit_spectral as fit_it
    else:
        from allanite.fitting.likelihood import fit_likelihood as fit_it
    try:
        model: NoiseModel = fit_it(recording, **options)
    except TypeError as error:
        if "unexpected keyword argument" not in str(error):
            raise
        raise InputError(f"method={method!r}: {error}") from None
    return model


def _check(method: str, allowed: tuple[str, ...], what: str, other: tuple[str, ...], instead: str) -> None:
    if method in allowed:
        return
    hint = f"; {method!r} works on {instead}" if method in other else ""
    raise InputError(f"for {what} the method must be {' or '.join(map(repr, allowed))}, not {method!r}{hint}")
