# SPDX-License-Identifier: BSD-3-Clause
"""Results in people's words: numbers with the digits their interval allows, in the units people use.

Terminal, report and figures say the same thing because they all say it through this package. It reads the plain
documents of results and holds no formula: it rounds, chooses units and makes sentences.

``study``    noise coefficients and what a study says of them
``findings``  what is wrong with a record
``provisos``  aperture, scale factor, what a run lacks
``rates``    Earth rate, filter and plan
``north``    directions
``selection``  weights of sets of terms
``rate_table``  the response to a rate table
``difference``  the unit of a drift
``dead_reckoning``  which errors of a navigator are shown
``calibration``  parameters of a self-calibration
``powers``   powers of ten with raised digits
"""
