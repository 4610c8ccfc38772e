# SPDX-License-Identifier: BSD-3-Clause
"""Put each seeded fault into a copy of the tree, and run the tests that must catch it.

python -m tests.faults                 all of them; exit code 1 where one is missed
python -m tests.faults ID ...          some
python -m tests.faults --list          their ids, and what each breaks
python -m tests.faults --try ID FILE   which tests of some files catch one, the quickest first
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.faults.scratch import Fault, Scratch, faults


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("ids", nargs="*", metavar="ID")
    parser.add_argument("--list", action="store_true", help="list the faults")
    parser.add_argument(
        "--try", dest="files", nargs="+", metavar="TEST", help="tests to look for the fault in"
    )
    given = parser.parse_args()
    known = faults()
    unknown = [i for i in given.ids if i not in known]
    if unknown:
        parser.error(f"no fault {', '.join(unknown)}; see --list")
    chosen = [known[i] for i in given.ids] or list(known.values())
    if given.list:
        print("\n".join(f"{f.id:34} {f.breaks}" for f in chosen))
        return 0
    with tempfile.TemporaryDirectory() as folder:
        scratch = Scratch(Path(folder))
        if given.files:
            return looked_for(scratch, chosen, given.files)
        return tried(scratch, chosen)


def looked_for(scratch: Scratch, chosen: Sequence[Fault], files: Sequence[str]) -> int:
    """Print which tests fail under each fault."""
    for fault in chosen:
        with scratch.holding(fault):
            found, _ = scratch.outcomes(files)
        failed = sorted((seconds, node) for node, (outcome, seconds) in found.items() if outcome == "failed")
        print(f"{fault.id}: {len(failed)} of {len(found)} tests")
        print("\n".join(f"  {seconds:7.2f} s  {node}" for seconds, node in failed), flush=True)
    return 0


def tried(scratch: Scratch, chosen: Sequence[Fault]) -> int:
    """Whether every fault is caught, and whether the same tests pass without one."""
    missed = []
    for fault in chosen:
        begun = time.monotonic()
        with scratch.holding(fault):
            found, said = scratch.outcomes(fault.caught_by)
        quiet = [node for node in fault.caught_by if not _failed(found, node)]
        if quiet or not fault.caught_by:
            missed.append(fault.id)
            print(said, file=sys.stderr)
        print(
            f"{'missed' if quiet else 'caught'}  {fault.id:34} {time.monotonic() - begun:5.1f} s", flush=True
        )
    tests = sorted({node for fault in chosen for node in fault.caught_by})
    sound, said = scratch.outcomes(tests)
    wrong = [node for node in tests if not _passed(sound, node)]
    if wrong:
        print(said, file=sys.stderr)
    print(f"{len(chosen) - len(missed)} of {len(chosen)} faults are caught")
    for text, nodes in (("missed:", missed), ("fails without a fault:", wrong)):
        if nodes:
            print(text, *nodes, sep="\n  ")
    return bool(missed or wrong)


def _of(found: dict[str, tuple[str, float]], node: str) -> list[str]:
    """Outcomes of a test, of all its parameters where none is named."""
    return [outcome for name, (outcome, _) in found.items() if name == node or name.startswith(f"{node}[")]


def _failed(found: dict[str, tuple[str, float]], node: str) -> bool:
    return "failed" in _of(found, node)


def _passed(found: dict[str, tuple[str, float]], node: str) -> bool:
    """All of them: a test that is skipped catches nothing."""
    return bool(_of(found, node)) and set(_of(found, node)) == {"passed"}


if __name__ == "__main__":
    raise SystemExit(main())
