# SPDX-License-Identifier: BSD-3-Clause
"""The rotation vector that three gyros at rest see, and its length against the Earth's rate.

    m(t) = C(t) Omega + bias + noise,    |C(t) Omega| = 15.041 deg/h whatever the attitude C.

The length needs no latitude, no heading and no levelling. It does contain the biases of the three gyros, which nothing
but turning separates from the Earth: only a sensor whose biases are well below 15 deg/h measures the Earth this way.

``stretches``   which parts of the record are at rest: cells of some seconds, by their own spread and their mean.
``poses``       turns of the sensor between the quiet stretches, from the rotation across the disturbed ones.
``estimation``  the vector, its covariance, the length and its interval.
``verdict``, ``checks``, ``words``  what may be said about it: codes, questions, sentences.
"""

from allanite.experiments.rate_vector.estimation import measure_rate_vector
from allanite.experiments.rate_vector.results import QuietMeans, RateSpan, RateVector

__all__ = ["QuietMeans", "RateSpan", "RateVector", "measure_rate_vector"]
