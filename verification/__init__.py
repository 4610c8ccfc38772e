# SPDX-License-Identifier: BSD-3-Clause
"""Long statistical runs: does an interval that says 95 % contain the truth in 95 % of the records?"""
