# SPDX-License-Identifier: BSD-3-Clause
"""Text and files as such: nothing here knows a sensor.

``regular_file``     the one way in for a file that somebody names; ``limits`` how large its shape may be
``atomic_file``      the one way out: written whole or not at all
``csv_cells``, ``json_values``, ``yaml_text``, ``yaml_validation``
    What is written into and read out of each.
``printable``        foreign text made safe to show; ``counted`` the noun and the verb beside a count

The lowest room: it imports errors only.
"""
