# SPDX-License-Identifier: BSD-3-Clause
"""Hundreds of logs, or a hundred thousand: what they say together.

``levels``  the profile of a coefficient as nine numbers, so that a row of a table holds it.
"""
