# SPDX-License-Identifier: BSD-3-Clause
"""A run while it is recorded: what has come, what is missing and why, the time that is left, the Allan curve so far.

``watch``    `RunWatch`: all of it together, look by look.
``samples``  what is summed up of the samples of one part of the run.
``stamps``   stamps of the host, evenly over the run, for the rate.
``story``    what the manifest tells besides samples.
"""

from allanite.commands.monitor.watch import RunWatch

__all__ = ["RunWatch"]
