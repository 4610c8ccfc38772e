# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of the field: units, uncertainties, laws, attitudes and the Earth.

``units``              what people write, in SI; ``display_units`` and back, for coefficients of noise
``quantity``           a number with its interval, unit and status; ``number_words`` writes it as people do
``result``             the base of results: documents out of them and back; ``verdict`` what they come to
``uncertain_number``   24.0(2), 24.0 ± 0.8 %
``distributions``      quantiles and tails; ``residual_tests`` questions put to residuals with them
``setup_uncertainty``  what the user knows of the set-up and no record shows
``attitude``, ``earth``
    Rotations, and what the Earth shows to a sensor.

Scalars and small arrays: no module here takes a record.
"""
