# SPDX-License-Identifier: BSD-3-Clause
"""Hundreds of logs, or a hundred thousand: what they say together, and which units do not belong.

``population``     describe_fleet(table): what a user calls.
``rows``           the table as columns.
``log_profiles``   what one log says of each coefficient.
``levels``         the profile of a coefficient as nine numbers, so that a row of a table holds it.
``profile_table``  the profiles of many logs as arrays, and what each says beside an expectation.
``evidence``       lots, units, repeats, conditions: how well given scales explain the logs.
``posterior``      all scales that the logs allow, with their weights.
``draws``          equally likely populations; ``capability``: the share of their units beyond a limit.
``densities``      where the units lie; ``correlations``: coefficients that vary together from unit to unit.
``drifts``         units that change over their repeats.
``standing_out``   units that do not belong to the population, at a stated rate of false discoveries.
``results``        FleetPopulation and its parts; ``verdict`` what it may come to, ``words`` says it in a sentence.
``charts``         the control chart of a coefficient, in ``chart_words``; ``control_rules``: when it signals.
``checking``       a unit beside its limits: pass, fail, cannot tell, in ``check_words``.
"""
