# SPDX-License-Identifier: BSD-3-Clause
"""Records through models and models into records: whatever steps along time.

``kalman``       filter, smoother and their tests, for any state space
``regression``   known columns in noise that is not white, on ``block_means``
``simulation``   records whose truth is known: noise, motion and the Earth

Recursions over samples are C++ kernels with a twin in NumPy.
"""
