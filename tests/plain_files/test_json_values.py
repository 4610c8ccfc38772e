# SPDX-License-Identifier: BSD-3-Clause
"""JSON that anybody may have written: the data, or an error of a value, whatever stands in it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from allanite.errors import FormatError
from allanite.plain_files.json_values import load_plain, parse_plain


def test_what_is_json_is_what_it_is() -> None:
    assert parse_plain('{"a": [1, -2.5, null, true, "b"], "c": {}}') == {
        "a": [1, -2.5, None, True, "b"],
        "c": {},
    }
    assert parse_plain(b"[" * 64 + b"1" + b"]" * 64)
    assert parse_plain("9" * 40) == int("9" * 40)
    assert math.isnan(parse_plain("NaN"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 65 + "]" * 65, "more than 64 deep"),
        ('{"a":' * 900 + "1" + "}" * 900, "more than 64 deep"),
        ("[" * 100_000, "more than 64 deep"),
        ("9" * 41, "41 digits; at most 40"),
        ("-" + "9" * 5000, "5001 digits"),
        ("1e400", "too large for a number in double precision"),
        ("[Infinity]", "Infinity is not a valid JSON number"),
        ("-Infinity", "-Infinity is not a valid JSON number"),
        ("{", "Expecting"),
    ],
)
def test_what_is_not_is_an_error_of_a_value(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        parse_plain(text)
    place = tmp_path / "a.json"
    place.write_text(text, encoding="utf-8")
    with pytest.raises(FormatError, match=f"(?s)is not JSON .*{words}.*: expected a study"):
        load_plain(place, "a study")
