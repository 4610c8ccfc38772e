# SPDX-License-Identifier: BSD-3-Clause
"""Runs on disk: what is acknowledged survives the death of the process, and a damaged byte is never a wrong value.

A run is a folder::

    manifest.jsonl     one line for each thing that happened, appended only: the header, segments with their SHA-256,
                       gaps with their reason, how it ended
    000001.arrows      segments: Arrow IPC streams with the header, and a CRC-32 in each batch
    000002.arrows

========== ====================================================================================
`header`   what is known before the first sample: channels, rate, instrument, settings
`batch`    samples as they come, with counter, clocks and flags
`message`  the bytes of a batch and of the opening of a segment; how they are verified
`disk`     the calls to the file system
`host_clock` the clock of samples and manifest, which goes on while the host sleeps
`manifest` its lines, and the lock against a second writer
`writing`  `LogStore`: batches in
`segment`  one segment read, from its beginning or from a `ReadPosition`
`rows`     verified rows as columns that are read piece by piece
`survey`   one pass over a run: where its samples and gaps are, and its rate
`following` `RunFollower`: what has come since the last look, across segments and parts
`run`      `open_run`: batches and recordings out, finished or still going
`recovery` `recover`: a damaged run made whole, and what was lost named
`compaction` `compact`: a finished run as one Parquet file
========== ====================================================================================
"""

from allanite.files.store.batch import Batch, Flag
from allanite.files.store.compaction import compact
from allanite.files.store.disk import Disk
from allanite.files.store.header import Header
from allanite.files.store.host_clock import host_ns
from allanite.files.store.recovery import Loss, Recovery, recover
from allanite.files.store.run import Run, open_run
from allanite.files.store.segment import ReadPosition
from allanite.files.store.survey import RunSurvey
from allanite.files.store.writing import LogStore, Status

__all__ = [
    "Batch",
    "Disk",
    "Flag",
    "Header",
    "LogStore",
    "Loss",
    "ReadPosition",
    "Recovery",
    "Run",
    "RunSurvey",
    "Status",
    "compact",
    "host_ns",
    "open_run",
    "recover",
]
