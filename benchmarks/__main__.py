# SPDX-License-Identifier: BSD-3-Clause
"""``make bench``: every measurement that takes minutes at most. `billion_samples` needs 12 GB and is run by hand."""

from pathlib import Path

from . import (
    allan_speed,
    characterize_speed,
    decimation_loss,
    filter_speed,
    fleet_table,
    kalman_speed,
    page_speed,
    read_speed,
    simulation_speed,
)

decimation_loss.main()
simulation_speed.main()
allan_speed.main()
kalman_speed.main()
filter_speed.main()
read_speed.main()
characterize_speed.main(Path())
page_speed.main()
fleet_table.main()
