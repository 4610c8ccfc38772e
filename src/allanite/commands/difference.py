# SPDX-License-Identifier: BSD-3-Clause
"""Two noise models side by side, from their files or words."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from allanite.commands.measurement import MeasurementResult, measured_result, provenance

__all__ = ["difference_of"]


def difference_of(
    pair: Sequence[str | os.PathLike[str]],
    *,
    seconds: Sequence[float] | None = None,
    rest: float | None = None,
    command: str | None = None,
) -> MeasurementResult:
    """Two sources of noise models; see `allanite.fitting.model_difference.model_difference`.

    Parameters
    ----------
    pair : two paths or words
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
    from allanite.study.result_document import Provenance

    one, other = pair
    sources = [load_models(source)[0] for source in pair]
    names = (_name(one), _name(other))
    if names[0] == names[1]:
        names = (str(one), str(other))
    result = model_difference(*sources, names=names, seconds=tuple(seconds or SECONDS), rest=rest)
    made = provenance(" and ".join(names), None, command)
    return measured_result("difference", result, lossy=False, provenance=Provenance(**made))


def _name(source: str | os.PathLike[str]) -> str:
    """Of the file; words speak for themselves."""
    return str(source) if "=" in str(source) and not Path(source).exists() else Path(source).name
