# SPDX-License-Identifier: BSD-3-Clause
"""Files for other programs, from the files that the commands leave."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from allanite.plain_files.json_values import parse_plain
from allanite.plain_files.regular_file import read_regular_text

__all__ = ["export_of"]


def export_of(
    consumer: str,
    source: str | os.PathLike[str],
    output: str | os.PathLike[str] | None = None,
    *,
    model: str | os.PathLike[str] | None = None,
    overbound: float | None = None,
    bound_until: float | None = None,
    rate: float | None = None,
    force: bool = False,
    **options: Any,
) -> str:
    """The text of a consumer's file, from a study or a calibration as the consumer needs it; see `export`.

    Parameters
    ----------
    source : path
        study.json, or whatever `load_models` reads; or calibration.json and whatever holds a calibration; as the
        consumer takes them.
    output : path, optional
        File to write; of several files their folder.
    model : path, optional
        Study with the noise, for a consumer that takes a calibration and noise.
    overbound : float, optional
        Write bounds that lie above the sensor with this probability in place of the fitted models, made of the terms
        that the consumer knows; `bound_until` is their horizon [s].
    rate : float, optional [Hz]
        Sample rate, where the source does not hold it; in place of that of another program's file.
    **options
        Those of the format; None: not given.

    Raises
    ------
    InputError
        No such consumer or option, or a source that does not hold what it needs.
    FormatError
        Files that are not what they should be.
    """
    from allanite.commands.bounds import bounds_of_study, with_bounds
    from allanite.errors import InputError
    from allanite.exporters import document_of, export, exporter
    from allanite.plain_files.regular_file import file_sha256
    from allanite.recording.calibration import Calibration
    from allanite.study.model_file import load_models
    from allanite.study.study import Study

    chosen = {key: value for key, value in options.items() if value is not None}
    module = exporter(consumer)
    if overbound is None and bound_until is not None:
        raise InputError(
            "--bound-until is the horizon of a bound: state its probability as well, --overbound 95%"
        )

    def loaded(path: str | os.PathLike[str]) -> Any:
        if not _is_study(path):
            if overbound is not None:
                raise InputError(f"a bound needs a study with its measured curve, not {path}")
            models, stated_rate = load_models(path)
            known = {"source": Path(path).name, "sha256": file_sha256(path)} if Path(path).is_file() else None
            return document_of(models, stated_rate if rate is None else rate, known)
        if rate is not None:
            raise InputError("the study knows its sample rate: rate= is for models that do not")
        study = Study.load(Path(path))
        if overbound is None:
            return study
        bound = bounds_of_study(
            study, probability=overbound, horizon=bound_until, terms=getattr(module, "TERMS", None)
        )
        return with_bounds(study, bound)

    if model is not None:
        chosen["model"] = loaded(model)
    if module.TAKES == "calibration" or (module.TAKES == "either" and _is_calibration(source)):
        if overbound is not None and model is None:
            raise InputError(
                f"{consumer} takes the noise from a study: pass it with --model, so that it can be bounded"
            )
        if rate is not None and model is None:
            raise InputError(
                "--rate is that of noise models, and a calibration has none: pass --model as well, or "
                "leave out --rate"
            )
        return export(consumer, Calibration.load(Path(source)), output, force=force, **chosen)
    return export(consumer, loaded(source), output, force=force, **chosen)


def _is_study(source: str | os.PathLike[str]) -> bool:
    """A document of allanite that `load_models` does not read: whatever it is, `Study.load` says so."""
    written = str(_document(source).get("format", ""))
    return written.startswith("allanite-") and written != "allanite-in-motion"


def _is_calibration(source: str | os.PathLike[str]) -> bool:
    document = _document(source)
    return document.get("format") == "allanite-calibration" or isinstance(document.get("calibration"), dict)


def _document(source: str | os.PathLike[str]) -> dict[str, Any]:
    """The JSON object of a file; an empty one where it is none, whose reader will say so."""
    try:
        content = parse_plain(read_regular_text(source))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}
