# SPDX-License-Identifier: BSD-3-Clause
"""``make bench``: every measurement that takes minutes at most. `billion_samples` needs 12 GB and is run by hand."""

from . import allan_speed, decimation_loss

decimation_loss.main()
allan_speed.main()
