# SPDX-License-Identifier: BSD-3-Clause
"""The spectral fit: noise parameters from the whole record, frequency by frequency.

``estimation``  the fit.
``modes``       the slowest contrasts of the record, across gaps; ``ordinates`` these and the bins of the spectrum.
``whittle``     the likelihood, its maximum; ``profile`` sets by likelihood ratio; ``misfit`` what no sum explains.
``agreement``   do the lags and the frequencies tell the same model?
``result``      from coefficients to a model.
``disagreements``, ``spectra``  what is said of both, for those who show it.
"""
