# SPDX-License-Identifier: BSD-3-Clause
"""The notebooks run, from the first cell to the last, in Python alone and in a kernel of Jupyter."""

from __future__ import annotations

import ast
import json
import math
from pathlib import Path
from typing import Any

import pytest
from notebook_pages import markdown_of

import allanite as al

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def cells(notebook: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return found


def code_of(notebook: Path) -> list[str]:
    return ["".join(cell["source"]) for cell in cells(notebook) if cell["cell_type"] == "code"]


def run(code: str, names: dict[str, object]) -> object:
    """Run a cell as IPython does; what its last line gives."""
    body = ast.parse(code).body
    last = body.pop() if isinstance(body[-1], ast.Expr) else None
    exec(compile(ast.Module(body, []), "cell", "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)


def test_there_are_notebooks() -> None:
    assert len(NOTEBOOKS) == 3


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_what_it_makes(
    notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "__main__"}
    shown = [value for code in code_of(notebook) if (value := run(code, names)) is not None]
    assert len(shown) >= 3
    for value in shown:
        assert len(value._repr_html_()) > 100  # type: ignore[attr-defined]


@pytest.mark.long
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_kernel_of_jupyter_runs_it(notebook: Path, tmp_path: Path) -> None:
    pytest.importorskip("ipykernel", reason="ipykernel is not installed")
    client = pytest.importorskip("nbclient")
    import nbformat

    document = nbformat.read(notebook, as_version=4)
    nbformat.validate(document)
    client.NotebookClient(document, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in document.cells for output in cell.get("outputs", ())]
    assert any("text/html" in output.get("data", {}) for output in outputs)
    assert not [output for output in outputs if output.output_type == "error"]


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_committed_without_outputs_and_with_public_names_alone(notebook: Path) -> None:
    for cell in cells(notebook):
        assert cell.get("outputs", []) == [] and cell.get("execution_count") is None
    for code in code_of(notebook):
        for node in ast.walk(ast.parse(code)):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "al":
                assert node.attr in al.__all__, node.attr


def test_a_notebook_is_a_page_of_the_site() -> None:
    for notebook in NOTEBOOKS:
        page = markdown_of(notebook.read_text(encoding="utf-8"))
        assert page.startswith("# ") and page.count("```python\n") == len(code_of(notebook))
        for code in code_of(notebook):
            assert f"```python\n{code}\n```" in page


@pytest.mark.long
def test_the_numbers_of_the_notebooks_are_those_of_the_truth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for code in code_of(FOLDER / "pandas-in-pandas-out.ipynb"):
        run(code, names)
    recording, frame = names["recording"], names["frame"]
    assert (recording.n_samples, len(frame)) == (60_000, 58_000) and abs(recording.rate - 100.0) < 1e-3
    white = names["numbers"].query("term == 'N'")
    truth = 0.3 * 2.908882e-4  # rad/√s
    holds = (white.lower < truth) & (truth < white.upper)
    assert holds.groupby(white.channel).any().sum() >= 2 and white.channel.nunique() == 3
    names = {}
    for code in code_of(FOLDER / "filter-and-earth-rate.ipynb"):
        run(code, names)
    lower, upper = names["estimate"].interval
    assert lower < math.radians(15.041 / 3600) < upper
