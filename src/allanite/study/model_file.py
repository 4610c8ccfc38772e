# SPDX-License-Identifier: BSD-3-Clause
"""Noise models out of files and words, and into files."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from allanite.errors import AllaniteError, FormatError, InputError
from allanite.files.foreign_models import models_of_matlab, models_of_yaml
from allanite.noise import (
    BY_LETTER,
    SIGMA_PER_B,
    GaussMarkov,
    NoiseModel,
)
from allanite.plain_files.atomic_file import fresh
from allanite.plain_files.json_values import load_plain
from allanite.plain_files.regular_file import open_regular
from allanite.quantities.units import QuantityKind, parse_unit

__all__ = ["load_models", "model_of", "save_models"]

_CLASSES = {  # what the unit of a coefficient may be: that of a gyro, or that of an accelerometer
    "Q": (QuantityKind.ANGLE, QuantityKind.VELOCITY),
    "N": (QuantityKind.GYRO_N, QuantityKind.ACCEL_N),
    "B": (QuantityKind.ANGLE_RATE, QuantityKind.ACCELERATION),
    "K": (QuantityKind.GYRO_K, QuantityKind.ACCEL_K),
    "R": (QuantityKind.GYRO_R, QuantityKind.ACCEL_R),
    "T": (QuantityKind.TIME,),
}
_WANTED = (
    "a study (study.json of 'allanite characterize LOG'), models (-o of 'allanite fit LOG'), a data sheet or a file of "
    "another program (.yaml), or words such as 'N=0.3 deg/√h, B=5 deg/h'"
)
#: A line such as ``update_rate: 200.0``, and how far down it is looked for.
_ENTRY, _HEAD = re.compile(rb"^[ \t]*[\w.]+[ \t]*:([ \t\r]|$)", re.MULTILINE), 1 << 16
_WORDS = re.compile(r"\s*([QNBKRT])(?:_b)?\s*=\s*((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d.].*?)\s*")
_BARE = re.compile(r"\s*([QNBKRT])(?:_b)?\s*=\s*(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\s*")
#: Of a gyro.
_EXAMPLE_UNITS = {"Q": "arcsec", "N": "deg/√h", "B": "deg/h", "K": "deg/h/√h", "R": "deg/h/h", "T": "s"}


def load_models(path: str | os.PathLike[str]) -> tuple[dict[str, NoiseModel], float | None]:
    """Load noise models by channel name.

    Parameters
    ----------
    path : path
        A study, what ``allanite in-motion`` or ``allanite fit --json`` prints, one model, a data sheet (YAML, see
        `allanite.study.datasheet`), a file of another program (Kalibr, OpenVINS, ORB-SLAM3, OKVIS, MATLAB; see
        `allanite.files.foreign_models`), or words as `model_of` takes them. The content decides, whatever the file is
        called.

    Returns
    -------
    models : dict of str to NoiseModel
    rate : float or None [Hz]
        Sample rate of the recording that was studied, or as stated by the file of another program.

    Raises
    ------
    FormatError
        Not JSON, or nothing that holds a model.
    InputError
        No such file, or one whose numbers do not say what they are.
    """
    if Path(path).suffix.lower() in (".yaml", ".yml"):
        return models_of_yaml(Path(path)) or _of_sheet(Path(path))
    if "=" in str(path) and not Path(path).exists():
        model = model_of(str(path))
        return {"gyro" if model.kind == "rate" else "accelerometer": model}, None
    try:
        content = load_plain(path, _WANTED)
    except FormatError:
        other = _of_yaml(Path(path))  # whatever the file is called
        if other is None:
            raise
        return other
    if isinstance(content, Mapping) and content.get("format") == "allanite-study":
        from allanite.study.study import Study

        study = Study.from_json(content)
        return study.models, study.recording.rate
    if isinstance(content, Mapping) and content.get("format") == "allanite-in-motion":
        from allanite.stability.in_motion import InMotion

        moved = InMotion.from_json(content)
        return moved.models, moved.rate
    if isinstance(content, Mapping) and "terms" in content:
        return {str(content.get("name") or "sensor"): NoiseModel.from_json(content)}, None
    if (
        isinstance(content, Mapping)
        and content
        and all(isinstance(m, Mapping) and "terms" in m for m in content.values())
    ):
        return {str(name): NoiseModel.from_json(model) for name, model in content.items()}, None
    other = models_of_matlab(content, Path(path)) if isinstance(content, Mapping) else None
    if other is not None:
        return other
    raise FormatError(
        f"{path} contains no noise model: expected a study, a model {{'terms': [{{'type': 'white', 'N': 1e-4}}]}}, "
        "an object of models by channel name, or the parameters of MATLAB's imuSensor"
    )


def _of_yaml(path: Path) -> tuple[dict[str, NoiseModel], float | None] | None:
    """Models of a file that is no JSON; None where it is no configuration of a program and no data sheet."""
    try:
        with open_regular(path) as file:
            head = file.read(_HEAD)
    except OSError:
        return None
    if not _ENTRY.search(head):  # a log, say, which the reader of YAML would take minutes for
        return None
    models = models_of_yaml(path)
    if models is not None:
        return models
    try:
        return _of_sheet(path)
    except AllaniteError:
        return None


def _of_sheet(path: Path) -> tuple[dict[str, NoiseModel], None]:
    from allanite.study.datasheet import read_datasheet

    return read_datasheet(path).models, None


def save_models(
    models: Mapping[str, NoiseModel | Mapping[str, Any]],
    path: str | os.PathLike[str],
    *,
    force: bool = False,
) -> Path:
    """Write models by channel name into a file that `load_models` and every ``--model`` read.

    Parameters
    ----------
    models : mapping of channel name to NoiseModel, or to the plain data of one
        Models to save.
    path : path
        File to write.
    force : bool
        Replace a file that is there.

    Returns
    -------
    Path
        The file that was written.

    Raises
    ------
    InputError
        Something else than models by name.
    StorageError
        The file exists and `force` is not given, or the disk refuses.
    """
    if not isinstance(models, Mapping) or not all(
        isinstance(m, (NoiseModel, Mapping)) for m in models.values()
    ):
        raise InputError(
            "save_models needs noise models by channel name, as in {'gyro': al.fit(recording)} or study.models, not "
            f"{models!r:.60}"
        )
    plain = {name: m.to_json() if isinstance(m, NoiseModel) else m for name, m in models.items()}
    with fresh(path, force=force) as place:
        place.write_text(json.dumps(plain, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")
    return Path(path)


def model_of(text: str) -> NoiseModel:
    """A noise model in words: ``"N=0.3 deg/√h, B=5 deg/h, K=5 deg/h/√h"``.

    Parameters
    ----------
    text : str
        Symbols are Q, N, B, K and R, each with its unit. With ``T=240 s`` the B is that of a Gauss-Markov term.

    Raises
    ------
    InputError
        A term without a unit or given twice, a unit of another quantity, or terms of different sensors.

    Examples
    --------
    >>> str(model_of("N=1e-4 rad/s/√Hz, K=1e-6 rad/s/√s"))
    'NoiseModel(N=0.0001; K=1e-06)'
    """
    values: dict[str, float] = {}
    kinds: set[str] = set()
    for part in text.split(","):
        symbol, value, kind = _coefficient(part)
        if symbol in values:
            raise InputError(f"{text!r}: {symbol} is given twice")
        values[symbol] = value
        kinds |= {kind} - {""}
    if len(kinds) != 1:
        raise InputError(f"{text!r}: all terms must belong to one sensor, a gyro or an accelerometer")
    time, bias = values.pop("T", None), values.get("B")
    if time is not None and bias is None:
        raise InputError(f"{text!r}: T is the correlation time of a Gauss-Markov term, which needs a B")
    terms = [
        BY_LETTER[symbol](**{symbol: value})
        for symbol, value in values.items()
        if symbol != "B" or time is None
    ]
    if time is not None and bias is not None:
        terms.append(GaussMarkov.from_sigma(SIGMA_PER_B * bias, time))
    return NoiseModel.of(*terms, kind=kinds.pop())


def _coefficient(text: str) -> tuple[str, float, str]:
    """Symbol, SI value and kind of sensor of one coefficient in words; no kind for a time."""
    match = _WORDS.fullmatch(text)
    if match is None and (bare := _BARE.fullmatch(text)):
        unit = _EXAMPLE_UNITS[bare[1]]
        raise InputError(f"{text.strip()!r} has no unit: write for example '{text.strip()} {unit}'")
    if match is None:
        raise InputError(f"{text.strip()!r} is not a noise term: write for example 'N=0.3 deg/√h, B=5 deg/h'")
    symbol, number, unit = match.groups()
    parsed = parse_unit(unit, _CLASSES[symbol])
    kind = "" if symbol == "T" else ("rate", "acceleration")[_CLASSES[symbol].index(parsed.quantity)]
    return symbol, float(number) * parsed.factor, kind
