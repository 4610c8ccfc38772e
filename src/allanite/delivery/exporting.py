# SPDX-License-Identifier: BSD-3-Clause
"""Files for other programs, from the files that the commands leave."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

__all__ = ["export_of"]


def export_of(
    consumer: str,
    source: str | os.PathLike[str],
    output: str | os.PathLike[str] | None = None,
    *,
    model: str | os.PathLike[str] | None = None,
    force: bool = False,
    **options: Any,
) -> str:
    """The text of a consumer's file, from a study or a calibration as the consumer needs it; see `export`.

    Parameters
    ----------
    source : path
        study.json, or calibration.json and whatever holds a calibration.
    output : path, optional
        File to write; of several files their folder.
    model : path, optional
        Study with the noise, for a consumer that takes a calibration and noise.
    **options
        Those of the format; None: not given.

    Raises
    ------
    InputError
        No such consumer or option, or a source that does not hold what it needs.
    FormatError
        Files that are not what they should be.
    """
    from allanite.calibration import Calibration
    from allanite.exporters import export, exporter
    from allanite.study import Study

    chosen = {key: value for key, value in options.items() if value is not None}
    if model is not None:
        chosen["model"] = Study.load(Path(model))
    takes = exporter(consumer).TAKES
    held = Calibration.load(Path(source)) if takes == "calibration" else Study.load(Path(source))
    return export(consumer, held, output, force=force, **chosen)
