# SPDX-License-Identifier: BSD-3-Clause
"""Names and answers that hold terminal commands are seen as escapes, at every door text leaves by."""

from __future__ import annotations

import ast
import io
import json
import sys
import unicodedata
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from allanite.commands.cli import main
from allanite.plain_files.printable import Shielded, printable
from sample_study import build

_SOURCE = Path(__file__).parents[2] / "src" / "allanite"
_COMMANDING = {"Cc", "Cf", "Cs", "Zl", "Zp"}
_HOSTILE = "g\x1b]0;owned\x07\x1b[2J\x9b31m\u202ex"


def commanding(text: str) -> list[str]:
    """Signs in a text of several lines that command a terminal."""
    return [c for c in text if unicodedata.category(c) in _COMMANDING and c not in "\t\n"]


def test_every_control_and_format_character_of_unicode_is_escaped_and_no_visible_one() -> None:
    signs = [chr(code) for code in range(sys.maxunicode + 1)]
    hidden = [c for c in signs if unicodedata.category(c) in _COMMANDING]
    assert all(printable(c) not in c and printable(c).isascii() for c in hidden)
    shown = [c for c in signs if unicodedata.category(c)[0] in "LNPS" or unicodedata.category(c) == "Zs"]
    assert all(printable(c) == c for c in shown)


@given(st.text())
def test_an_escaped_text_is_stable_and_json_still_reads_what_was_meant(text: str) -> None:
    shown = printable(text)
    assert printable(shown) == shown and not commanding(shown) and "\n" not in shown
    assert printable(text, lines=True).count("\n") == text.count("\n")
    dumped = json.dumps({"name": text}, ensure_ascii=False)
    assert json.loads(printable(dumped, lines=True)) == {"name": text}


def test_a_stream_has_no_way_round() -> None:
    bare = io.TextIOWrapper(io.BytesIO(), "ascii", errors="replace")
    stream = Shielded(Shielded(bare))
    assert stream.write(_HOSTILE) == len(_HOSTILE) and stream.encoding == "ascii"
    stream.writelines([_HOSTILE, "\n"])
    stream.flush()
    raw = bare.buffer
    assert isinstance(raw, io.BytesIO)
    assert b"\x1b" not in raw.getvalue() and raw.getvalue().count(b"u001b") == 4
    with pytest.raises(AttributeError):
        stream.buffer  # noqa: B018


# -- the program ------------------------------------------------------------------------------------------


def said_by(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    """Exit code, and all that a command writes."""
    with pytest.raises(SystemExit) as left:
        main([str(w) for w in words])
    shown = capsys.readouterr()
    assert isinstance(left.value.code, int)
    return left.value.code, shown.out + shown.err


@pytest.fixture
def hostile_log(tmp_path: Path) -> Path:
    """An HDF5 file that says it in every place: names, units, attributes, its own name."""
    log = tmp_path / f"{_HOSTILE}\nallanite: note: all is well.h5"
    with h5py.File(log, "w") as file:
        for name in (_HOSTILE, f"acc{_HOSTILE}"):
            data = file.create_dataset(name, data=np.random.default_rng(5).normal(size=400))
            data.attrs["units"] = f"deg/s{_HOSTILE}"
        file.attrs[_HOSTILE] = _HOSTILE
    return log


@pytest.mark.parametrize(
    "words",
    [
        ["info"],
        ["info", "--rate", "100", "--unit", "deg/s"],
        ["info", "--rate", "100", "--unit", "deg/s", "--json"],
        ["info", "--channels", f"none{_HOSTILE}", "--rate", "100"],
        ["spectrum", "--rate", "100", "--unit", "deg/s"],
        ["recover"],
        ["report"],
    ],
)
def test_no_command_passes_on_what_a_file_says(
    words: list[str], hostile_log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, text = said_by(capsys, words[0], hostile_log, *words[1:])
    assert code in (0, 1, 2, 3) and text
    assert not commanding(text)
    assert not any(line.startswith("allanite: note: all is well") for line in text.splitlines())


def test_a_wrong_word_is_shown_escaped(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["info", f"/nowhere/{_HOSTILE}"], ["info", "x", f"--{_HOSTILE}"], [_HOSTILE]):
        code, text = said_by(capsys, *words)
        assert code in (1, 2) and ("\\u001b" in text or "\\x1b" in text) and not commanding(text)


def test_a_result_of_somebody_else_is_drawn_and_shown_escaped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its names reach figures too, and XML holds no control character."""
    document = json.dumps(build())
    name = json.loads(document)["channels"][0]["name"]
    study = tmp_path / "study.json"
    study.write_text(
        document.replace(json.dumps(name), json.dumps(_HOSTILE + "\0 $x$ <q>")), encoding="utf-8"
    )
    code, text = said_by(capsys, "report", study, "--output", tmp_path / "report.html")
    assert code == 0 and not commanding(text)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    ours = page[: page.index("<script")] + page[page.rindex("</script>") :]
    assert "\\u001b]0;owned" in ours and not commanding(ours) and "<q>" not in ours


# -- no other door ----------------------------------------------------------------------------------------


def _doors(module: Path) -> list[str]:
    """Calls by which text could leave the program unseen by `Shielded` and the console."""
    found = []
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
        raw = ast.unparse(node) if isinstance(node, ast.Attribute) else ""
        if called in ("print", "rich.print", "Console", "rich.console.Console"):
            found.append(called)
        if raw in ("sys.__stdout__", "sys.__stderr__", "sys.stdout.buffer", "sys.stderr.buffer"):
            found.append(raw)
    return found


def test_text_leaves_by_the_shielded_streams_and_the_console_alone() -> None:
    found: dict[str, Any] = {
        path.relative_to(_SOURCE).as_posix(): doors
        for path in sorted(_SOURCE.rglob("*.py"))
        if any(
            word in path.read_text(encoding="utf-8") for word in ("print(", "Console(", "__std", ".buffer")
        )
        and (doors := _doors(path))
    }
    assert found == {}
