# SPDX-License-Identifier: BSD-3-Clause
"""What was measured, and whether it is fit to be used.

``records``          Recording and Channel: samples with their times, kinds and units
``sample_columns``   where the samples are: in memory, in a file, spliced
``channel_names``    what a name tells; ``clock_channels`` phases and frequencies; ``position_rows`` tables of means
``calibration``      three axes: bias, scale factors, misalignments
``health``           findings: what is wrong, where and how much
``cleaning``         repairs, by name and never by default

Samples are never changed in place; a missing one is NaN.
"""
