# SPDX-License-Identifier: BSD-3-Clause
"""Noise parameters by maximum likelihood: a week at 32 Hz in seconds, within some percent of the Cramer-Rao bound.

``pyramid``    one pass over the record: block means of block means, and second moments of what is within the blocks.
``pool``       those moments, and what a term makes of them.
``objective``  log-likelihood, gradient, expected information; ``bands`` octaves: first guess and goodness of fit.
``maximum``    the maximum over any sum of terms; ``profile`` confidence sets.
``lines``      spectral lines; ``exact`` all samples through the Kalman filter.
``problem``    LikelihoodProblem: what other fits and model selection are built on.
``family``     a sum of terms with its sets; ``coarser`` what part of a record terms explain; ``result`` the model.
``slow``       what else explains slow noise.
"""

from __future__ import annotations

from allanite.fitting.likelihood.problem import LikelihoodProblem, Maximum
from allanite.fitting.likelihood.result import fit_likelihood, fit_problem

__all__ = ["LikelihoodProblem", "Maximum", "fit_likelihood", "fit_problem"]
