# SPDX-License-Identifier: BSD-3-Clause
"""NoiseModel from a curve: one file per estimator.

``slopes``     the seed's reading of the curve, for comparison.
``moments``    the fit: full covariance, non-negative terms, sets by test inversion.
``families``   flicker or Gauss-Markov; ``sets`` test inversion; ``objective`` and ``design`` its numerics.
``advice``     how long to record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from allanite.allan import AllanCurve
    from allanite.noise import NoiseModel

__all__ = ["fit"]


def fit(
    curve: AllanCurve,
    *,
    method: str = "moments",
    exclude: ArrayLike | None = None,
    confidence: float = 0.95,
) -> NoiseModel:
    """Fit a noise model to the Allan curve of one channel.

    Parameters
    ----------
    curve : AllanCurve
        One channel; take it out of several by ``curve["x"]``.
    method : "moments" or "slopes"
        "moments" gives intervals and says what is not supported; "slopes" is the seed's reading, without either.
    exclude : array_like of bool, shape (n_lags,), optional
        Lags to leave out.
    confidence : float
        Level of the intervals.

    Returns
    -------
    NoiseModel
        With `estimates`, `covariance`, `goodness`, and `alternative` where the two families cannot be told apart.

    Raises
    ------
    InputError
        An unknown method, several channels, or another statistic than oadev.
    DataQualityError
        The curve holds no noise or too few lags.
    FitError
        No minimum was found.
    """
    if method == "moments":
        from allanite.fitting.moments import fit_moments

        return fit_moments(curve, exclude=exclude, confidence=confidence)
    if method == "slopes":
        from allanite.fitting.slopes import read_slopes

        return read_slopes(curve, exclude=exclude)
    raise InputError(f"method must be 'moments' or 'slopes', not {method!r}")
