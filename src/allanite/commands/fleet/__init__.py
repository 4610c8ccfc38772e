# SPDX-License-Identifier: BSD-3-Clause
"""Many logs, characterized one by one, and their results as one table.

`running`      what a user calls: fleet(paths) -> FleetRun
`addresses`    which logs there are, in folders and behind fsspec addresses
`labels`       what the path of a log and a metadata table say of it; `pattern` reads the path
`jobs`         one task for each log, over an executor; lost workers are replaced
`worker`       runs a task on the machine that got it, in a process of its own
`log_process`  that process: it forks a child for each log, within limits of time and memory
`one_log`      what the child does: a log -> rows
`rows`         a study -> rows
`table`        the columns; rows -> an Arrow table; `partitions`: fleet.parquet on disk
`folder`       what is done and what is not, kept through a loss of power
`watching`     new logs as they come
`sheet_limits` the values of a data sheet, as limits
`report`       the declaration of fleet report: population, units that stand out; `chart`, `check`: those of the others
"""
