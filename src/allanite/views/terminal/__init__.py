# SPDX-License-Identifier: BSD-3-Clause
"""Results as text in a terminal: findings and tables on stdout, a progress bar on stderr.

``page``       a result's blocks, and the models of a file
``study``      a curve, a recording, its findings
``monitor``    a run that grows; ``capture`` what a recorder reports
``recovery``   what was saved of a run
``exporting``  the programs that take a model
``console``    where text goes; ``style`` its colors
"""
