# SPDX-License-Identifier: BSD-3-Clause
"""What a data sheet promises, beside what was measured.

``sheet``     Datasheet, read out of YAML (`allanite.noise.datasheet` says what an entry means).
``judgement`` hold_against(study, sheet): a verdict for each statement, and the curves.
"""

from allanite.study.datasheet.judgement import (
    ChannelJudgement,
    DatasheetJudgement,
    DatasheetVerdict,
    StatementJudgement,
    StatementNote,
    StatementVerdict,
    hold_against,
)
from allanite.study.datasheet.sheet import Datasheet, SheetSection, read_datasheet

__all__ = [
    "ChannelJudgement",
    "Datasheet",
    "DatasheetJudgement",
    "DatasheetVerdict",
    "SheetSection",
    "StatementJudgement",
    "StatementNote",
    "StatementVerdict",
    "hold_against",
    "read_datasheet",
]
