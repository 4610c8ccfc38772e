# SPDX-License-Identifier: BSD-3-Clause
"""The table of seeded faults (`make faults`) fits the tree: each can be put in, and its tests are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.faults.scratch import ROOT, Fault, faults, place_of

FAULTS = faults()


@pytest.mark.parametrize("fault", FAULTS.values(), ids=list(FAULTS))
def test_fault_can_be_put_in(fault: Fault) -> None:
    assert place_of(fault) is None
    assert fault.breaks.endswith(".") and fault.caught_by


def test_tests_that_catch_faults_are_there() -> None:
    named = {node.partition("[")[0] for fault in FAULTS.values() for node in fault.caught_by}
    missing = [node for node in sorted(named) if not is_there(*node.split("::"))]
    assert not missing and len(FAULTS) >= 60


def is_there(file: str, test: str) -> bool:
    path: Path = ROOT / file
    return path.exists() and re.search(rf"^def {test}\(", path.read_text(encoding="utf-8"), re.M) is not None
