# SPDX-License-Identifier: BSD-3-Clause
"""The week in words: limits and intervals are counted apart."""

from __future__ import annotations

from allanite_seed_paper.words import week_lines, week_words


def test_a_week_counts_limits_apart_from_intervals() -> None:
    rows = [
        {"symbol": "N", "published": 2.0, "value": 2.1, "lower": 1.9, "upper": 2.2, "supported": True},
        {"symbol": "B", "published": 1.0, "value": 2.0, "lower": 1.5, "upper": 2.5, "supported": True},
        {"symbol": "T", "published": 200.0, "value": None, "lower": 0.0, "upper": None, "supported": False},
        {"symbol": "K", "published": 1.0, "value": None, "lower": 0.0, "upper": 3.0, "supported": False},
    ]
    week = {"parameters": [{**row, "slope": None} for row in rows]}
    white, bias, time, walk = week_lines(week)
    assert (white.inside, bias.inside, time.inside, walk.inside) == (True, False, True, True)
    assert walk.value.startswith("below ") and time.value == "not bounded"
    assert week_words(week) == (
        "1 of 2 published parameters with a 95 % interval lie inside it; 1 of 1 with an upper limit alone lie below "
        "it; 1 is not bounded"
    )
