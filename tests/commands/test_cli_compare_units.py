# SPDX-License-Identifier: BSD-3-Clause
"""compare: where some of the logs lack a unit that another has, the option that states it runs as it is printed."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from allanite.commands.cli import cli

HEADS = ("time [s],gx [deg/s],gy [deg/s]", "time [s],gx,gy", "time [s],gx [deg/s],gy")


@pytest.mark.long
@pytest.mark.parametrize("order", [(0, 1), (0, 2), (1, 0, 1)])
def test_the_units_that_are_asked_for_run(
    tmp_path: Path, order: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(3)
    names = []
    for k, head in enumerate(order):
        rows = rng.normal(scale=0.1, size=(3000, 2))
        names.append(f"log {k}.csv")
        Path(names[-1]).write_text(
            HEADS[head] + "\n" + "".join(f"{i / 100:.2f},{x:.5f},{y:.5f}\n" for i, (x, y) in enumerate(rows))
        )
    first = CliRunner().invoke(cli, ["compare", *names])
    said = re.search(r"--unit ('[^']*'|\S+);", str(first.exception))
    assert said, first.exception
    again = CliRunner().invoke(cli, ["compare", *names, "--unit", *shlex.split(said[1])])
    assert again.exit_code == 0, again.exception
