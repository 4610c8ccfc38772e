# SPDX-License-Identifier: BSD-3-Clause
"""The last net: whatever a command raises ends in a sentence and an exit code, a defect of ours in a report to send."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Callable
from pathlib import Path

import click
import pytest

from allanite import errors
from allanite.commands.cli import cli, main
from allanite.commands.cli.child import _command, _done
from allanite.errors import FormatError


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state" / "allanite"


@pytest.fixture
def fails(monkeypatch: pytest.MonkeyPatch) -> Callable[[BaseException], None]:
    """Makes `allanite broken SECRET` raise."""

    def prepare(error: BaseException) -> None:
        @click.command("broken")
        @click.argument("word")
        def broken(word: str) -> None:
            raise error

        monkeypatch.setitem(cli.commands, "broken", broken)

    return prepare


def ended(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[object, str]:
    with pytest.raises(SystemExit) as left:
        main(words)
    shown = capsys.readouterr()
    assert "Traceback" not in shown.out + shown.err
    return left.value.code, shown.err


DEFECTS = [
    ValueError("Exceeds the limit (4300 digits) for integer string conversion"),
    KeyError("\x1b[31m"),
    RecursionError("maximum recursion depth exceeded"),
    AssertionError(),
    UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"),
    ZeroDivisionError("division by zero"),
    ImportError("no such thing"),
]


@pytest.mark.parametrize("error", DEFECTS, ids=lambda e: type(e).__name__)
def test_a_defect_is_a_sentence_and_a_file_to_send(
    error: Exception,
    state: Path,
    fails: Callable[[BaseException], None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    fails(error)
    code, said = ended(capsys, "broken", "word")
    assert code == 70
    found = re.fullmatch(
        rf"allanite: internal error: {type(error).__name__} in .*This is a defect in allanite; please report it "
        r"with (\S+), which contains the command and the traceback\n",
        said,
    )
    assert found is not None
    report = Path(found[1])
    assert report.parent == state and report.stat().st_mode & 0o077 == 0
    text = report.read_text(encoding="utf-8")
    assert "Traceback" in text and type(error).__name__ in text and "command:" in text and "Python 3" in text


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (FormatError("a.npy: damaged: copy it again"), 1, "a.npy: damaged: copy it again"),
        (OSError(errno.ENAMETOOLONG, "File name too long", "x"), 1, "x: File name too long; give another"),
        (MemoryError(), 1, "not enough memory"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
    ids=["ours", "system", "memory", "interrupted"],
)
def test_what_is_no_defect_has_no_report(
    error: BaseException,
    code: int,
    words: str,
    state: Path,
    fails: Callable[[BaseException], None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    fails(error)
    assert ended(capsys, "broken", "word")[0] == code
    fails(error)
    assert words in ended(capsys, "broken", "word")[1] and not state.exists()


def test_where_no_report_can_be_written_the_sentence_holds_the_error(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    fails: Callable[[BaseException], None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    fails(KeyError("what it was"))
    code, said = ended(capsys, "broken", "word")
    assert code == 70 and "what it was" in said and "please report it" in said


def test_a_job_of_the_page_ends_as_the_program_does(
    state: Path, fails: Callable[[BaseException], None]
) -> None:
    fails(KeyError("gone"))
    end = _command(["broken", "word"], lambda *_: None)  # type: ignore[arg-type]
    assert end["exit"] == 70 and "please report it" in end["stderr"]
    assert len(list(state.iterdir())) == 1


def test_a_task_of_the_page_that_meets_a_defect_says_so(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from allanite.commands.page import tasks

    def defect(*_: object) -> dict[str, object]:
        raise RecursionError("too deep")

    def refusal(*_: object) -> dict[str, object]:
        raise FormatError("this file is damaged")

    place = os.fspath(tmp_path / "scratch")
    for work, code, words in ((defect, 70, "please report it"), (refusal, 1, "this file is damaged")):
        monkeypatch.setitem(tasks.TASKS, "series", work)
        with Path(os.devnull).open("w") as nothing:
            end = _done({"task": "series", "log": place}, nothing)
        assert end["exit"] == code and words in end["message"]


def test_every_error_of_ours_is_a_refusal(
    state: Path, fails: Callable[[BaseException], None], capsys: pytest.CaptureFixture[str]
) -> None:
    for kind in (getattr(errors, name) for name in errors.__all__ if name.endswith("Error")):
        fails(kind("this and that; do so"))
        assert ended(capsys, "broken", "word") == (1, "allanite: this and that; do so\n")
    assert not state.exists()
