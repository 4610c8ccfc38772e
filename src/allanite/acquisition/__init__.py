# SPDX-License-Identifier: BSD-3-Clause
"""Instruments, and what records them.

``instruments``  wire -> blocks of samples: 3458A, serial units, simulated ones; none knows another
``capture``      instrument -> run on disk, through silence, unplugging, stalling disks and clocks that are set
"""
