# SPDX-License-Identifier: BSD-3-Clause
"""Does one model hold: along a record, from record to record, beside another sensor, at another temperature?

``variation``           the Allan deviation over time, and a test that it stays
``record_comparison``   several records: are they alike, and how much do they scatter?
``shared_noise``        what sensors that were recorded together have in common
``fleet``               hundreds of logs: profiles as numbers of a table
``environment``         temperature and warm-up, told from the noise and removed
"""
