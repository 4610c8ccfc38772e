# SPDX-License-Identifier: BSD-3-Clause
"""Mutate every format in turn until the time is over; save what fails.

python -m tests.fuzz --seconds 600 --seed 1
python -m tests.fuzz --replay build/fuzz/text-1a2b3c4d
"""

from __future__ import annotations

import argparse
import hashlib
import json
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from tests.fuzz.mutations import mutated
from tests.fuzz.seeds import FORMATS, Seed, placed, seeds_of
from tests.hostile_files import CODES, MOST_MEMORY, MOST_SECONDS, Attempt, Outcome, fault_of, measured

_CRASHES = {signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL}
FAILURES = Path("build/fuzz")  # where they are saved
_BATCH = 15  # files of a format before the next one has its turn
_BY_COMMAND = 5  # one file of so many is opened by the command line


@cache
def sound(name: str) -> list[Seed]:
    """Seeds of a format, made once."""
    return seeds_of(name)


@dataclass
class Tally:
    """What became of the files of a format."""

    codes: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0
    memory: int = 0

    def add(self, found: Outcome) -> None:
        self.codes[CODES.get(found.code, f"signal {-found.code}")] += 1
        self.seconds, self.memory = max(self.seconds, found.seconds), max(self.memory, found.memory)


def attempted(seeds: Sequence[Seed], folder: Path) -> list[Outcome]:
    """What becomes of seeds, each in a folder of its own; a parser that dies gets a child to die in, as for a user."""
    attempts = [
        Attempt(path=placed(seed, folder / str(i)), role=seed.role, options=seed.options)
        for i, seed in enumerate(seeds)
    ]
    outcomes = measured(attempts)
    dead = [i for i, found in enumerate(outcomes) if -found.code in _CRASHES]
    if dead:
        again = measured([attempts[i] for i in dead], in_children=True)
        for i, found in zip(dead, again, strict=True):
            outcomes[i] = found
    return outcomes


def lot(name: str, rng: np.random.Generator, count: int = _BATCH) -> list[Seed]:
    """Mutated seeds of a format; some are opened by the command line."""
    seeds = sound(name)
    made = [mutated(seeds[rng.integers(len(seeds))], seeds, rng) for _ in range(count)]
    by_command = {"log": "info", "run": "info"}
    return [
        replace(seed, role=by_command.get(seed.role, seed.role)) if k % _BY_COMMAND == 0 else seed
        for k, seed in enumerate(made)
    ]


def saved(seed: Seed, found: Outcome, name: str, why: str, out: Path) -> Path:
    """Keep a file that fails, what came of it, and the command that repeats it."""
    mark = hashlib.sha256(b"".join(seed.files[k] for k in sorted(seed.files))).hexdigest()[:8]
    folder = out / f"{''.join(c if c.isalnum() else '-' for c in name)}-{mark}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for file, content in seed.files.items():
        (folder / file).write_bytes(content)
    facts = {"opened": seed.opened, "role": seed.role, "options": seed.options, "why": why}
    (folder / "attempt.json").write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    (folder / "outcome.txt").write_text(found.message + "\n", encoding="utf-8")
    return folder


def stored(folder: Path) -> Seed:
    """What `saved` has kept."""
    facts = json.loads((folder / "attempt.json").read_text(encoding="utf-8"))
    files = {
        p.name: p.read_bytes() for p in folder.iterdir() if p.name not in ("attempt.json", "outcome.txt")
    }
    return Seed(files=files, opened=facts["opened"], role=facts["role"], options=facts["options"])


def replay(folder: Path) -> int:
    with tempfile.TemporaryDirectory(prefix="allanite-") as place:
        (found,) = attempted([stored(folder)], Path(place))
    print(
        f"{CODES.get(found.code, found.code)}, {found.seconds:.1f} s, {found.memory >> 20} MiB\n{found.message}"
    )
    return 1 if fault_of(found) else 0


def fuzz(seconds: float, seed: int, names: Sequence[str], out: Path) -> int:
    """Number of files that failed."""
    rng, ends = np.random.default_rng(seed), time.monotonic() + seconds
    tallies = {name: Tally() for name in names}
    failed = 0
    print(f"seed {seed}, {seconds:g} s, {len(names)} formats", flush=True)
    while time.monotonic() < ends:
        lots = [(name, one) for name in names for one in lot(name, rng)]
        with tempfile.TemporaryDirectory(prefix="allanite-") as place:
            outcomes = attempted([one for _, one in lots], Path(place))
        for (name, one), found in zip(lots, outcomes, strict=True):
            tallies[name].add(found)
            why = fault_of(found)
            if why:
                failed += 1
                kept = saved(one, found, name, why, out)
                print(f"{name}: {why}\n  {sys.executable} -m tests.fuzz --replay {kept}", flush=True)
    return _told(tallies, failed)


def _told(tallies: dict[str, Tally], failed: int) -> int:
    for name, tally in tallies.items():
        codes = ", ".join(f"{n} {what}" for what, n in sorted(tally.codes.items())) or "not reached"
        print(f"{name:28} {codes}; at most {tally.seconds:.1f} s, {tally.memory >> 20} MiB")
    total = sum(sum(t.codes.values()) for t in tallies.values())
    print(
        f"{total} files, {failed} failed (a traceback, or above {MOST_SECONDS} s or {MOST_MEMORY >> 20} MiB)"
    )
    return failed


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=None, help="the same seed makes the same files")
    parser.add_argument(
        "--format", action="append", choices=list(FORMATS), help="only this one; may be repeated"
    )
    parser.add_argument("--out", type=Path, default=FAILURES, help="where failures are saved")
    parser.add_argument("--replay", type=Path, help="open a saved failure once more")
    given: Any = parser.parse_args(arguments)
    if given.replay is not None:
        return replay(given.replay)
    seed = int(time.time()) if given.seed is None else given.seed
    return 1 if fuzz(given.seconds, seed, given.format or list(FORMATS), given.out) else 0


if __name__ == "__main__":
    sys.exit(main())
