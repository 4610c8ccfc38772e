# SPDX-License-Identifier: BSD-3-Clause
"""The command `innovations`: columns by name and as stated, files, figure."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.views.figures import sheet_of
from allanite.views.registry import document_of
from allanite.views.result_page import view_of
from shell import Run


def _log(place: Path, heads: str, size: float = 3.0, n: int = 4000, power: int = 1) -> Path:
    rng = np.random.default_rng(1)
    sd = 0.5 + 0.4 * np.sin(np.arange(n) / 300)
    e = np.column_stack([size * sd, sd]) * rng.standard_normal((n, 2))
    stated = np.column_stack([sd**power, sd**power])
    np.savetxt(
        place, np.column_stack([np.arange(n) / 10, e, stated]), delimiter=",", header=heads, comments=""
    )
    return place


@pytest.mark.parametrize(
    ("heads", "power", "options"),
    [
        ("t [s],nu_x,nu_y,S_x,S_y", 2, ()),
        ("t [s],x,y,var_x,var_y", 2, ()),
        ("t [s],x,y,x_sd,y_sd", 1, ()),
        ("t [s],a,b,c,d", 2, ("--innovations", "a,b", "--variances", "c,d")),
        ("t [s],a,b,c,d", 1, ("--innovations", "a,b", "--deviations", "c,d")),
    ],
)
def test_columns_are_told_apart_by_name_or_as_stated(
    tmp_path: Path, run: Run, heads: str, power: int, options: tuple[str, ...]
) -> None:
    done = run("innovations", _log(tmp_path / "filter.csv", heads, power=power), *options, "--json")
    assert done.code == 0, done.err
    loud, right = json.loads(done.out)["axes"]
    assert loud["fast"]["value"] == pytest.approx(3.0, rel=0.1) and loud["verdict"] == "fails"
    assert right["fast"]["value"] == pytest.approx(1.0, rel=0.1) and right["verdict"] == "consistent"


def test_verdict_tables_and_figure(tmp_path: Path, run: Run) -> None:
    out = tmp_path / "out"
    log = _log(tmp_path / "filter.csv", "t [s],nu_x,nu_y,S_x,S_y", power=2)
    done = run("innovations", log, "--out", out, "--plot", tmp_path / "f.png")
    assert done.code == 0, done.err
    assert done.out.startswith(
        "The filter's noise does not hold. nu_x: the measurement noise (N) is too small"
    )
    assert "Multiply N or K of the filter by its factor" in done.out
    assert (tmp_path / "f.png").stat().st_size > 10_000
    rows = list(csv.DictReader((out / "bands.csv").open(encoding="utf-8")))
    assert {row["axis"] for row in rows} == {"nu_x", "nu_y"} and float(rows[-1]["upper_hz"]) == 5.0
    assert len(list(csv.DictReader((out / "nis.csv").open(encoding="utf-8")))) == 100
    saved = document_of(json.loads((out / "innovations.json").read_text(encoding="utf-8")))
    assert [s.id for s in view_of(saved).sections][:3] == ["verdict", "pictures", "bands"]
    assert len(sheet_of(saved.result).rows) == 2 and len(sheet_of(saved.result, view="nis").rows) == 1


@pytest.mark.long
def test_columns_that_do_not_pair_are_refused_and_stated_as_the_refusal_says(
    tmp_path: Path, run: Run
) -> None:
    log = _log(tmp_path / "filter.csv", "t [s],a,b,c,d", power=2)
    done = run("innovations", log)
    assert done.code == 1 and "name both, --innovations and --variances (or --deviations)" in done.err
    assert run("innovations", log, "--innovations", "a,b", "--variances", "c,d").code == 0
    done = run("innovations", log, "--variances", "c,d", "--deviations", "c,d")
    assert done.code == 2 and "leave one out" in done.err


def test_a_short_log_has_no_figure_of_bands(tmp_path: Path, run: Run) -> None:
    log = _log(tmp_path / "filter.csv", "t [s],nu_x,nu_y,S_x,S_y", n=50, power=2)
    done = run("innovations", log, "--json")
    assert done.code == 0, done.err
    result = document_of(json.loads(done.out)).result
    assert len(sheet_of(result).rows) == 1
    with pytest.raises(InputError, match="no figure 'bands' of innovations"):
        sheet_of(result, view="bands")
