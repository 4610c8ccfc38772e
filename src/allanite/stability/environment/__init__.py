# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the environment: temperature and warm-up, told from the noise, removed, and said.

``climate``          signal and temperature on blocks
``design``           the columns of the regression
``noise_left_open``  regression in noise that is fitted to the same record
``warming``          a warm-up, found by a test
``questions``        lag of the thermometer, hysteresis
``estimation``       all of it for one channel, or for several
``effect``           what is removed, sample by sample
``correction``       the Allan curve of the residual
"""
