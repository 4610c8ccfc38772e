# SPDX-License-Identifier: BSD-3-Clause
"""What is measured with a sensor once its noise is known.

``reversals``, ``static_spans``, ``setup``
    When was it turned, when was it at rest, and what is known of the setup?
``earth_rate``, ``rate_vector``, ``north``, ``alignment``
    The Earth's rotation and the directions that it gives.
``calibration``, ``rate_table``, ``redundancy``
    The sensor against gravity, the Earth, a table, and other sensors.
``planning``, ``position_planning``, ``dead_reckoning``, ``reference_aided``
    What to expect before, and what the noise costs after.
"""
