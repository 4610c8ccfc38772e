# SPDX-License-Identifier: BSD-3-Clause
"""YAML files as plain data with lines: what is merged or meant by a tag, and what is no such file."""

from __future__ import annotations

from pathlib import Path

import pytest

from allanite.errors import FormatError, InputError, LimitError
from allanite.files.readers.raw_layout import read_layout
from allanite.plain_files.yaml_text import read_yaml, read_yaml_lines, read_yaml_texts

TEXT = """\
usual: &usual {type: i16, scale: 0x10}
fields:
  - name: x
    <<: *usual
  - <<: *usual
rate: 1e-3
on: yes
2: true
"""


def test_what_is_merged_in_is_there_and_has_no_line_of_its_own(tmp_path: Path) -> None:
    place = tmp_path / "a.yaml"
    place.write_text(TEXT, encoding="utf-8")
    found, lines = read_yaml_lines(place, "thing")
    usual = {"type": "i16", "scale": 16}
    assert found == {
        "usual": usual, "fields": [{"name": "x", **usual}, usual], "rate": 1e-3, "on": "yes", "2": True,
    }  # fmt: skip
    assert {type(found["rate"]), type(found["on"]), type(found["2"])} == {float, str, bool}
    assert lines["fields", 0, "name"] == 3
    assert lines["fields", 1] == 5
    assert lines["rate",] == 6
    assert ("fields", 0, "type") not in lines
    assert read_yaml(place, "thing") == {**{k: v for k, v in found.items() if k != "2"}, 2: True}


@pytest.mark.parametrize("reader", [read_yaml, read_yaml_lines])
def test_what_is_no_such_file(tmp_path: Path, reader: object) -> None:
    place = tmp_path / "a.yaml"
    with pytest.raises(InputError, match=r"no such file: .*a\.yaml"):
        reader(place, "thing")  # type: ignore[operator]
    place.write_text("a: " + "1" * (1 << 18))
    with pytest.raises(
        FormatError, match=r"a\.yaml has 262147 bytes; at most 262144 .*: that is not a thing"
    ):
        reader(place, "thing")  # type: ignore[operator]
    place.write_bytes(b"a: \xff")
    with pytest.raises(FormatError, match=r"a\.yaml cannot be read: .*utf-8"):
        reader(place, "thing")  # type: ignore[operator]
    with pytest.raises(InputError, match="is a folder; expected a file"):
        reader(tmp_path, "thing")  # type: ignore[operator]
    for text in ("a: [", "a: 1\na: 2", "a: *b"):
        place.write_text(text)
        with pytest.raises(FormatError, match=r"a\.yaml is not YAML"):
            reader(place, "thing")  # type: ignore[operator]


@pytest.mark.parametrize("reader", [read_yaml, read_yaml_lines, read_yaml_texts])
def test_entries_that_contain_themselves_or_more_than_a_person_writes(tmp_path: Path, reader: object) -> None:
    place = tmp_path / "a.yaml"
    tenfold = "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 9))
    for text, error, words in (
        (
            "a: &a\n  <<: *a\n  b: 1\n",
            FormatError,
            r"is not YAML: line 2: the alias \*a refers to nothing",
        ),
        (f"a0: &a0 [1]\n{tenfold}", LimitError, "line 6: more than 40000 entries, counting aliases"),
    ):
        place.write_text(text)
        with pytest.raises(error, match=words):
            reader(place, "thing")  # type: ignore[operator]


@pytest.mark.long
@pytest.mark.parametrize("reader", [read_yaml, read_yaml_lines, read_yaml_texts])
@pytest.mark.parametrize("text", ["[" * 50_000, "- " * 50_000, "{a: " * 10_000])
def test_depth_is_refused_before_it_costs_time(tmp_path: Path, reader: object, text: str) -> None:
    place = tmp_path / "a.yaml"
    place.write_text(text)
    with pytest.raises(LimitError, match=r"a\.yaml, line 1: lists and mappings more than 64 deep"):
        reader(place, "thing")  # type: ignore[operator]


@pytest.mark.parametrize("reader", [read_yaml, read_yaml_lines])
@pytest.mark.parametrize("number", ["0x" + "f" * 5000, "7" * 41, "[{a: -" + "7" * 5000 + "}]"])
def test_numbers_of_thousands_of_digits(tmp_path: Path, reader: object, number: str) -> None:
    place = tmp_path / "a.yaml"
    place.write_text(f"a: {number}")
    with pytest.raises(FormatError, match=r"a\.yaml is not YAML: .*digits"):
        reader(place, "thing")  # type: ignore[operator]


@pytest.mark.parametrize("reader", [read_yaml, read_yaml_lines])
def test_a_whole_file_with_a_tag_of_a_language_is_refused_as_such(tmp_path: Path, reader: object) -> None:
    place = tmp_path / "a.yaml"
    place.write_text("# first\n!!python/object/apply:os.system [ls]\n")
    with pytest.raises(FormatError, match=r"a\.yaml, line 2: the tag python/object/apply:os\.system"):
        reader(place, "thing")  # type: ignore[operator]
    place.write_text("a: 'no !!python/object'\nb: !!str 3\n")
    read_yaml(place, "thing")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (
            "rate: !!python/object/apply:os.mkdir [MARKER]",
            "line 1: the tag python/object/apply:os.mkdir belongs to a programming language",
        ),
        ("rate: !!python/name:os.system", "line 1: the tag python/name:os.system belongs to a programming"),
        ("rate: !ruby/object:Set {}", "tag !ruby/object:Set .* is not read; write plain text"),
        ("rate: 60:30:00", "line 1, rate: should be a valid number"),
        ("on: 1", "line 1, on: is not a known entry"),
        ("a: &a [1, 1]\nb: &b [*a, *a]\nc: {b: *b, c: *b}", "not a known entry"),
    ],
)
def test_f8_what_yaml_can_do_beyond_text_is_refused(tmp_path: Path, line: str, message: str) -> None:
    place, marker = tmp_path / "a.yaml", tmp_path / "marker"
    frame = "frame: {fields: [{name: x, type: i16}]}\n"
    place.write_text(line.replace("MARKER", str(marker)) + "\n" + frame)
    with pytest.raises(FormatError, match=message):
        read_layout(place)
    assert not marker.exists()
    place.write_text("rate: 1e3\n" + frame)
    assert read_layout(place).rate == 1000.0
