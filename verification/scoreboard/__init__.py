# SPDX-License-Identifier: BSD-3-Clause
"""The scoreboard: the same records through the tools that people use today, and through allanite.

``rules``      reading rules of the tools of the Robot Operating System, written anew.
``tools``      every contender at its best: what it is asked, what it answers.
``accuracy``   bias and coverage of N, B, K, T_b over many simulated records.
``bars``       error bars of the deviation itself.
``hardships``  one NaN, an overload, float32, holes.
``cost``       seconds and memory, a billion samples.
``page``, ``picture``  docs/scoreboard.md, results/scoreboard.png.

The contenders are no dependency of anything: those that are installed take part.
"""
