# SPDX-License-Identifier: BSD-3-Clause
"""The frozen results (`make frozen`) in small: what counts as equal, and one result against its golden files."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.frozen.__main__ import GOLDEN, OTHERS, differences, helps, result
from tests.frozen.compared import alike, difference, lines_of
from tests.frozen.doors import document, report, spread
from tests.frozen.records import faulty, still
from tests.frozen.results import EXACT, NEEDS, RESULTS


def test_numbers_are_compared_within_their_tolerance_and_text_exactly() -> None:
    assert alike("a.N ~ 1.00000000 nan", "a.N ~ 1.00000050 nan")
    assert not alike("a.N ~ 1.00000000", "a.N ~ 1.00000200")
    assert not alike("a.N ~ 1 nan", "a.N ~ 1 2")
    assert alike("tau = 1.00000000000000", "tau = 1.0000000000005")
    assert not alike("tau = 1.00000000000000", "tau = 1.000000000002")
    assert not alike("says = '1.0 deg'", "says = '1.00 deg'")
    assert not alike("N 0.300 deg", "N 0.301 deg")


def test_one_number_among_many_shows() -> None:
    values = [0.1 * k for k in range(500)]
    (frozen,) = lines_of(values, "x")
    assert alike(frozen, next(lines_of([v * (1 + 1e-9) for v in values], "x")))
    values[250] *= 1.01
    assert difference("door", frozen, next(lines_of(values, "x")))[:2] == ["--- frozen/door", "+++ now/door"]


def test_doors_keep_words_and_numbers() -> None:
    assert document('{"tau": [1, 2], "fit": {"N": 0.3, "says": "ok"}}').splitlines() == [
        "tau = 1 2",
        "fit.N ~ 0.3",
        "fit.says = 'ok'",
    ]
    assert spread("# note\ntau,sd\n1,2\n").splitlines() == ["# note", "tau,sd", "0 tau = 1", "0 sd ~ 2"]
    page = "<style>p {}</style><h2>Head</h2><p class=note>a <b>b</b></p><tr><td>1<td>2</tr><script>x</script>"
    assert report(page).splitlines() == ["## Head", "(note) a b", "| 1 | 2"]


def test_every_result_has_its_golden_files() -> None:
    assert {p.name.split(".")[0] for p in GOLDEN.glob("*.txt")} == {*RESULTS, *OTHERS}
    assert {*NEEDS, *EXACT}.union(*NEEDS.values()) <= {*RESULTS}


def test_no_two_results_write_to_one_place() -> None:
    """The second would be refused, or freeze what is of the first."""
    written: dict[str, str] = {}
    for name, commands in RESULTS.items():
        for place in re.findall(r" (?:--out|--plot|-o) ([\w./-]+)", " ".join(commands)):
            assert written.setdefault(place, name) == name, place


def test_refused_and_repaired_files_are_as_they_were_frozen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    still()
    faulty()
    assert not differences(GOLDEN, "small", result("small"))
    assert not differences(GOLDEN, "help", helps())
