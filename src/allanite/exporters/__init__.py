# SPDX-License-Identifier: BSD-3-Clause
"""Somebody else's file from a study, one module per consumer.

`kalibr` is the example to imitate. To add a consumer: one module with `NAME`, `FILE_NAME`, `SUMMARY` and `write`,
one word in `EXPORTERS`, one golden file in ``tests/published``.

An exporter reads the plain document of a study, never the data and never a kernel. It writes what the consumer's own
code will make of the numbers, says in a comment what was chosen, and refuses rather than guesses.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping
from importlib import import_module
from typing import Any, Final, Protocol, cast

from allanite.atomic_file import fresh
from allanite.errors import InputError
from allanite.noise import NoiseModel

__all__ = ["EXPORTERS", "Exporter", "export", "exporter"]

#: Modules of this package that write a format.
EXPORTERS: Final = ("kalibr", "firmware")


class Exporter(Protocol):
    """What an exporter module has; see `allanite.exporters.kalibr`."""

    NAME: str
    FILE_NAME: str
    SUMMARY: str

    def write(self, document: Mapping[str, Any], **options: Any) -> str:
        """The text of the file for a study document."""
        ...


def exporter(name: str) -> Exporter:
    """The module that writes a format.

    Raises
    ------
    InputError
        No such format; the message lists those there are.
    """
    if name not in EXPORTERS:
        raise InputError(f"no export format {name!r}; there are: {', '.join(EXPORTERS)}")
    return cast(Exporter, import_module(f"{__name__}.{name}"))


def export(
    name: str,
    study: Any,
    path: str | os.PathLike[str] | None = None,
    *,
    force: bool = False,
    rate: float | None = None,
    **options: Any,
) -> str:
    """Write a study, or noise models, in the format of another program.

    Parameters
    ----------
    name : str
        "kalibr": the imu.yaml of Kalibr. "firmware": a C++ header with the constants of a bias filter.
    study : Study, dict or mapping of channel name to NoiseModel
        A study, its document, or bare models (then `rate` is needed and their `kind` says what they are).
    path : path, optional
        Where to write; without it the text is only returned.
    force : bool
        Replace a file that is there.
    rate : float, optional [Hz]
        Sample rate of bare models.
    **options
        Those of the format's `write`, for example ``walk="k-only"``.

    Returns
    -------
    str
        The text of the file.

    Raises
    ------
    InputError
        An unknown format or option, or a study that does not hold what the format needs.
    StorageError
        The file exists and `force` is not set, or the disk refuses.

    Examples
    --------
    >>> from allanite.noise import NoiseModel, RandomWalk, White
    >>> gyro = NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-6))
    >>> print(export("kalibr", {"gyro": gyro}, rate=200.0).splitlines()[-1])
    gyroscope_random_walk: 1.000000e-06  # rad/s^2/sqrt(Hz)
    """
    write = exporter(name).write
    known = [p for p in inspect.signature(write).parameters if p != "document"]
    unknown = [o for o in options if o not in known]
    if unknown:
        raise InputError(f"{name} has no option {unknown[0]!r}; there are: {', '.join(known)}")
    text = write(_document(study, rate), **options)
    if path is not None:
        with fresh(path, force=force) as place:
            place.write_text(text, encoding="utf-8", newline="\n")
    return text


def _document(study: Any, rate: float | None) -> Mapping[str, Any]:
    if hasattr(study, "to_json") and not isinstance(study, NoiseModel):
        study = study.to_json()
    if not isinstance(study, Mapping) or not study:
        raise InputError(f"export needs a study or a mapping of channel names to noise models, not {study!r}")
    if not all(isinstance(value, NoiseModel) for value in study.values()):
        if "channels" not in study or "recording" not in study:
            raise InputError("the document is not a study: it has no 'channels' and 'recording'")
        return study
    if rate is None:
        raise InputError("bare noise models do not know their sample rate: give rate=")
    channels = [
        {
            "name": name,
            "kind": model.kind,
            "unit": model.unit,
            "models": [m.to_json() for m in model.families],
        }
        for name, model in study.items()
    ]
    return {"provenance": {}, "recording": {"rate": rate}, "channels": channels}
