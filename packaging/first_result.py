# SPDX-License-Identifier: BSD-3-Clause
"""The first result of an installed allanite: an hour of a gyro, from a log to a report and an imu.yaml.

`make release-check` runs this in an empty environment, the workflow `wheels` with each wheel on its system, and the
recipe of conda. It needs the package and its dependencies alone. A number that differs ends it with an error.
"""

from __future__ import annotations

import json
import math
import os
import sys
import tempfile
from pathlib import Path

MODEL = "N=0.7 deg/√h, B=10 deg/h"
#: The fit on Linux with x86-64 [rad/√s, rad/s]; elsewhere it may end a little beside, as far as its search goes.
EXPECTED = {"N": 0.0002041165050921677, "B": 4.384086077691146e-05}
WITHIN = 1e-6
WANTED = ("report.html", "study.json", "allan.csv", "imu.yaml")


def run(*words: str) -> None:
    """A command as it would be typed, in this process."""
    from allanite.commands.cli import main

    print("$ allanite", *words, flush=True)
    try:
        main(words)
    except SystemExit as end:
        if end.code:
            raise RuntimeError(f"allanite {' '.join(words)} ended with code {end.code}") from None


def estimates(study: Path) -> dict[str, float]:
    """N and B of the one channel of a study, by its first model."""
    (channel,) = json.loads(study.read_text(encoding="utf-8"))["channels"]
    terms = channel["models"][0]["terms"]
    return {symbol: term[symbol] for term in terms for symbol in EXPECTED if symbol in term}


def main() -> None:
    """Make the first result in a new folder."""
    import allanite
    from allanite import _kernels

    print(f"allanite {allanite.__version__}, {_kernels.__file__}")
    print(f"Python {sys.version.split()[0]} on {sys.platform}")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        run(
            "simulate",
            MODEL,
            "--rate",
            "32",
            "--duration",
            "1h",
            "--unit",
            "deg/s",
            "--seed",
            "1",
            "-o",
            "gyro.csv",
        )
        run("characterize", "gyro.csv", "--out", "gyro")
        missing = [name for name in WANTED if not Path("gyro", name).is_file()]
        found = estimates(Path("gyro", "study.json"))
        os.chdir(Path(folder).anchor)
    if missing:
        raise SystemExit(f"missing: {', '.join(missing)}")
    for symbol, wanted in EXPECTED.items():
        if not math.isclose(found[symbol], wanted, rel_tol=WITHIN):
            raise SystemExit(f"{symbol} is {found[symbol]:.12g}, expected {wanted:.12g} within {WITHIN:g}")
    print("first result: as expected")


if __name__ == "__main__":
    main()
