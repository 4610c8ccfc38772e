# SPDX-License-Identifier: BSD-3-Clause
"""Two noise models side by side, from their files or words."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from allanite.commands.measurement import MeasurementResult, provenance

__all__ = ["difference_of"]


def difference_of(
    first: str | os.PathLike[str],
    second: str | os.PathLike[str],
    *,
    seconds: Sequence[float] | None = None,
    rest: float | None = None,
    command: str | None = None,
    progress: Any = None,
) -> MeasurementResult:
    """Two sources of noise models; see `allanite.fitting.model_difference.model_difference`.

    Parameters
    ----------
    first, second : path or words
        Whatever `load_models` reads.
    seconds : sequence of float, optional [s]
        After how long drifts are told; 1, 100 and 1000 by default.
    rest : float, optional [s]

    Raises
    ------
    InputError
        No such file, numbers that do not say what they are, or no sensor in common.
    FormatError
        Files that hold no model.
    """
    from allanite.fitting.model_difference import SECONDS, model_difference
    from allanite.study.model_file import load_models

    sources = [load_models(source)[0] for source in (first, second)]
    names = (_name(first), _name(second))
    if names[0] == names[1]:
        names = (str(first), str(second))
    result = model_difference(*sources, names=names, seconds=tuple(seconds or SECONDS), rest=rest)
    document = result.to_json()
    document["provenance"] = provenance(f"{names[0]} and {names[1]}", None, command)
    return MeasurementResult(
        result=result,
        document=document,
        name="difference",
        tables={"difference.csv": _rows(document)},
        lossy=False,
    )


def _name(source: str | os.PathLike[str]) -> str:
    """Of the file; words speak for themselves."""
    return str(source) if "=" in str(source) and not Path(source).exists() else Path(source).name


def _rows(document: dict[str, Any]) -> list[dict[str, Any]]:
    """The table of drifts in SI."""
    return [
        {"first": channel["names"][0], "second": channel["names"][1], **_line(line)}
        for channel in document["channels"]
        for line in channel["drifts"]
    ]


def _line(line: dict[str, Any]) -> dict[str, Any]:
    return {f"drift_{key}" if key in ("first", "second") else key: value for key, value in line.items()}
