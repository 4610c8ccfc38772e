# SPDX-License-Identifier: BSD-3-Clause
"""The experiment of the seed paper on a simulated twin, as an example of the library; `allanite demo` runs it.

`twin`           the bench of Silva, Jeronymo, Pavan and Tosin: its sensor, its week at rest, its four takes
`demonstration`  the whole experiment, from samples to files
`figures`        counterparts of the thirteen figures of the paper
`words`          the results in words; `terminal` and `report` show them
"""
