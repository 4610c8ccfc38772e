# SPDX-License-Identifier: BSD-3-Clause
"""A record on a rate table: its channels, clocks and range, its samples as rows of a regression, and the fit.

``channels``          which channel is on the axis, and whether a model is its
``timing``, ``clocks``  offset and drift against the table's clock, settling
``clipping``          rates beyond the range
``rows``, ``fit``     the regression
``bandwidth``         gain and phase of sinusoids
``aided``             the seed paper's filter, where it is at home
"""
