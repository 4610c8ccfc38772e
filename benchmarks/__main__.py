# SPDX-License-Identifier: BSD-3-Clause
"""``make bench``: every measurement that takes minutes at most.

`growth` takes half an hour and 8 GB, `billion_samples` 12 GB: they are run by hand.
"""

from . import allan_speed, decimation_loss, fleet_table, jobs, kalman_speed, page_speed, read_speed

jobs.main()
decimation_loss.main()
allan_speed.main()
kalman_speed.main()
read_speed.main()
page_speed.main()
fleet_table.main()
