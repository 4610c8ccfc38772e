# SPDX-License-Identifier: BSD-3-Clause
"""Freeze what the program says, or compare it with what was frozen.

python -m tests.frozen --check                            every result; exit code 1 where one differs
python -m tests.frozen --check --only north align         some of them, with those that they need
python -m tests.frozen --write tests/frozen/golden        freeze anew, after a change that is meant
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import chdir
from pathlib import Path

import click
from tests.frozen.compared import FITTED, difference
from tests.frozen.doors import Text, called, document, kept, normal
from tests.frozen.page import offered
from tests.frozen.records import written
from tests.frozen.results import EXACT, NEEDS, RESULTS

from allanite.commands.cli import cli

GOLDEN = Path(__file__).parent / "golden"
_DEFECT = 70


def frozen(names: Sequence[str]) -> Iterator[tuple[str, Text]]:
    """Each result with what its doors show, made in the current folder."""
    written()
    done: set[str] = set()
    for name in names:
        for needed in (*NEEDS.get(name, ()), name):
            if needed not in done:
                done.add(needed)
                made = result(needed)
                if needed in names:
                    yield needed, made


def result(name: str) -> Text:
    """What the doors of one result show."""
    doors: Text = {}
    before = _files()
    for command in RESULTS[name]:
        whole, alone = re.sub(r"[\[\]]", "", command), re.sub(r" ?\[.*?\]", "", command)
        for columns, said in ((80, whole), (120, alone)):
            if columns == 120 and (" --json" in command or "narrow" in command):
                continue
            code, out, err = called(said, columns)
            if code == _DEFECT:
                raise RuntimeError(f"{name}: allanite {said}\n{err}")
            if " --json" in command and out:
                out = document(out)
            text = f"$ allanite {said}\n{out}{_told(err)}exit {code}\n\n"
            door = "document" if " --json" in command else f"terminal-{columns}"
            doors[door] = doors.get(door, "") + text
    for path in sorted(_files() - before):
        if path.parts[0] != "runs":  # what is of a run depends on the clock
            door, text = kept(path, exact=name in EXACT)
            doors[door] = doors.get(door, "") + f"== {path}\n{text}\n"
    return doors


def page() -> Text:
    """What the page offers over two logs and a result."""
    folder = Path("page").resolve()
    folder.mkdir()
    for name in ("one.csv", "two.csv"):
        (folder / name).write_text("time [s],gyro [deg/s]\n0,1\n0.1,2\n0.2,1\n", encoding="utf-8")
    called(
        f'plan --model "N=0.1 deg/√h" --latitude 48.1 --dwells 60 --out {folder}/allanite-results/plan', 80
    )
    return {"forms": normal(offered(folder))}


def _told(err: str) -> str:
    return "".join(f"! {line}\n" for line in err.splitlines())


def _files() -> set[Path]:
    return {p for p in Path().rglob("*") if p.is_file()}


def helps() -> Text:
    """`--help` of the program, of every command and of every command below it."""

    def shown(command: click.Command, *words: str) -> str:
        code, out, err = called(" ".join([*words, "--help"]), 80)
        assert code == 0, err
        below = command.commands if isinstance(command, click.Group) else {}
        inner = [shown(each, *words, name) for name, each in sorted(below.items())]
        return "\n".join([f"== {' '.join(['allanite', *words])}", out, *inner])

    return {"help": shown(cli)}


#: What is asked of the program as a whole.
OTHERS = {"help": helps, "page": page}


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--write", type=Path, metavar="DIR", help="write the golden files to this folder")
    parser.add_argument("--check", action="store_true", help="compare with the golden files")
    parser.add_argument(
        "--only", nargs="+", choices=[*RESULTS, *OTHERS], metavar="RESULT", help="these results alone"
    )
    parser.add_argument("--fitted", type=float, default=FITTED, help="relative tolerance of what is fitted")
    given = parser.parse_args()
    if bool(given.write) == given.check:
        parser.error("say --check or --write DIR")
    folder = given.write.resolve() if given.write else GOLDEN
    names = given.only or [*RESULTS, *OTHERS]
    wrong: list[str] = []
    for name, doors in everything(names):
        if given.write:
            write(folder, name, doors)
        else:
            wrong += differences(folder, name, doors, given.fitted)
    print("\n".join(wrong) if wrong else "all is as it was frozen" if given.check else f"written to {folder}")
    return bool(wrong)


def everything(names: Sequence[str]) -> Iterator[tuple[str, Text]]:
    """All that was asked for, in a folder of its own, with the time that each took."""
    with tempfile.TemporaryDirectory() as place, chdir(place):
        for name, made in OTHERS.items():
            if name in names:
                yield name, made()
        begun = time.process_time()
        for name, doors in frozen([n for n in names if n not in OTHERS]):
            print(f"{name}: {time.process_time() - begun:.1f} s", file=sys.stderr)
            begun = time.process_time()
            yield name, doors


def write(folder: Path, name: str, doors: Text) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob(f"{name}.*.txt"):
        old.unlink()
    for door, text in doors.items():
        (folder / f"{name}.{door}.txt").write_text(text, encoding="utf-8")


def differences(folder: Path, name: str, doors: Text, fitted: float = FITTED) -> list[str]:
    """What differs at any door of a result; a door that is gone or new is a difference, too."""
    stored = {
        p.name.split(".")[1]: p.read_text(encoding="utf-8") for p in sorted(folder.glob(f"{name}.*.txt"))
    }
    return [
        line
        for door in sorted({*stored, *doors})
        for line in difference(f"{name}.{door}", stored.get(door, ""), doors.get(door, ""), fitted)
    ]


if __name__ == "__main__":
    raise SystemExit(main())
