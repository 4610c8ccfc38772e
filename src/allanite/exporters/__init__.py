# SPDX-License-Identifier: BSD-3-Clause
"""Somebody else's file from a study or a calibration, one module per consumer.

`kalibr` is the example to imitate, and `okvis` where the format has no options of its own: its `write` is made of a
template. `allanite.exporters.imu` holds what consumers of noise share. To add a consumer: one module with `NAME`,
`FILE_NAME`, `SUMMARY`, `TAKES` and `write`, one word in `EXPORTERS`, one golden file in ``tests/published``. A consumer
of noise has `USAGE` as well, the keys and formulas by which it writes and which the documents show, and its own step in
``tests/consumers.py``, which finds the model again in the file.

An exporter reads the plain document of a study or of a calibration, never the data and never a kernel. It writes what
the consumer's own code will make of the numbers, says in a comment what was chosen, and refuses rather than guesses.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol, TypeGuard, cast, get_args

from allanite.errors import InputError
from allanite.plain_files.atomic_file import fresh, make_folder, refuse_existing

if TYPE_CHECKING:
    from allanite.noise import NoiseModel

__all__ = ["EXPORTERS", "Exporter", "document_of", "export", "exporter", "options_of"]

#: Modules of this package that write a format.
EXPORTERS: Final = (
    "kalibr",
    "openvins",
    "vins",
    "orb_slam3",
    "okvis",
    "gtsam",
    "pyins",
    "kf_gins",
    "ob_gins",
    "navego",
    "psins",
    "gnss_ins_sim",
    "gazebo",
    "gazebo_classic",
    "matlab",
    "px4",
    "ardupilot",
    "kimera",
    "basalt",
    "maplab",
    "rovio",
    "lio_sam",
    "fast_lio",
    "ros_imu",
    "airsim",
    "carla",
    "isaac",
    "mujoco",
    "webots",
    "imu_tk",
    "cpp",
)


class Exporter(Protocol):
    """What an exporter module has; see `allanite.exporters.kalibr`."""

    NAME: str
    FILE_NAME: str
    SUMMARY: str
    TAKES: Literal["study", "calibration", "either"]

    def write(self, document: Mapping[str, Any], **options: Any) -> str | Mapping[str, str | bytes]:
        """The text of the file for a document; contents by file name where there are several."""
        ...


def exporter(name: str) -> Exporter:
    """The module that writes a format.

    Raises
    ------
    InputError
        No such format; the message lists those there are.
    """
    module = str(name).replace("-", "_")
    if module not in EXPORTERS:
        there = [known.replace("_", "-") for known in EXPORTERS]
        near = get_close_matches(module.lower().replace("_", "-"), there, n=1)
        meant = f" (did you mean {near[0]!r}?)" if near else ""
        raise InputError(f"no export format {name!r}{meant}; there are: {', '.join(there)}")
    return cast(Exporter, import_module(f"{__name__}.{module}"))


def export(
    name: str,
    study: Any,
    path: str | os.PathLike[str] | None = None,
    *,
    force: bool = False,
    rate: float | None = None,
    **options: Any,
) -> str:
    """Write a study, noise models or a calibration in the format of another program.

    Parameters
    ----------
    name : str
        Of a study: "kalibr" (imu.yaml), "vins", "orb-slam3", "okvis", "gtsam", "pyins", "kf-gins", "ob-gins",
        "navego", "psins", "gnss-ins-sim", "gazebo", "gazebo-classic", "matlab", "px4", "ardupilot", "kimera",
        "basalt", "maplab", "rovio", "lio-sam", "fast-lio", "ros-imu", "airsim", "carla", "isaac", "mujoco", "webots";
        "cpp", a C++ header: a bias filter for firmware. Of a calibration: "imu-tk". Of either: "openvins"
        (kalibr_imu_chain.yaml).
    study : Study, dict, NoiseModel, mapping of channel name to NoiseModel, or Calibration
        A study, its document, or bare models (then `rate` is needed and their `kind` says what they are). For
        "imu-tk", and for "openvins" where there is one, a calibration, its document, or one that holds it.
    path : path, optional
        File to write; without it the text is only returned. Several files are written to this folder.
    force : bool
        Replace a file that is there.
    rate : float, optional [Hz]
        Sample rate of bare models.
    **options
        Those of the format's `write`, for example ``walk="k-only"``; ``model=`` of "openvins" is a study, or models.

    Returns
    -------
    str
        Text of the file; several files follow each other, each after a line with its name. A binary file is represented
        by its size.

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
    module = exporter(name)
    known = options_of(module)
    unknown = [o for o in options if o not in known]
    if unknown:
        there = ", ".join(f"{option}=" for option in known) or "none"
        raise InputError(f"{name} has no option {unknown[0]}=; there are: {there}")
    study = _by_channel(study)
    if module.TAKES == "calibration" or (module.TAKES == "either" and not _is_study(study)):
        if options.get("model") is not None:
            options["model"] = _document(_by_channel(options["model"]), rate)
        content = module.write(_calibration(study, name), **options)
    else:
        content = module.write(_document(study, rate), **options)
    if isinstance(content, Mapping):
        return _several(content, path, force)
    if path is not None:
        with fresh(path, force=force) as place:
            place.write_text(content, encoding="utf-8", newline="\n")
    return content


def options_of(module: Exporter) -> list[str]:
    """Names of the options of a format, those of a TypedDict among them."""
    names: list[str] = []
    for parameter in inspect.signature(module.write, eval_str=True).parameters.values():
        if parameter.kind is parameter.VAR_KEYWORD:
            names += get_args(parameter.annotation)[0].__annotations__
        elif parameter.name != "document":
            names.append(parameter.name)
    return names


def _several(content: Mapping[str, str | bytes], path: str | os.PathLike[str] | None, force: bool) -> str:
    """Write files into a folder, all or none."""
    if path is not None:
        folder = Path(path)
        refuse_existing(*(folder / name for name in content), force=force)
        make_folder(folder)
        for name, text in content.items():
            with fresh(folder / name, force=force) as place:
                place.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
    return "\n".join(
        f"# {name}\n{text}" if isinstance(text, str) else f"# {name}: binary, {len(text)} bytes"
        for name, text in content.items()
    )


def _is_study(source: Any) -> bool:
    """A study, its document, or bare models; a calibration is none of them."""
    document = source.to_json() if hasattr(source, "to_json") else source
    if not isinstance(document, Mapping) or not document:
        return False
    return _are_models(document) or (
        "channels" in document and "recording" in document and "calibration" not in document
    )


def _are_models(document: Mapping[str, Any]) -> TypeGuard[Mapping[str, NoiseModel]]:
    from allanite.noise import (
        NoiseModel,
    )  # the list of consumers, which a shell completes, does not wait for NumPy

    return all(isinstance(value, NoiseModel) for value in document.values())


def _calibration(source: Any, name: str) -> Mapping[str, Any]:
    """The plain document of a calibration, or of a result that holds one."""
    document = source.to_json() if hasattr(source, "to_json") else source
    held = document.get("calibration", document) if isinstance(document, Mapping) else None
    if not isinstance(held, Mapping) or held.get("format") != "allanite-calibration":
        raise InputError(
            f"{name} takes a calibration, the output of `allanite calibrate`, not {_named(document)}"
        )
    return held


def _named(document: Any) -> str:
    if isinstance(document, Mapping):
        return f"a document of format {document.get('format')!r}"
    return f"a {type(document).__name__}"


def _by_channel(study: Any) -> Any:
    """A noise model by itself as that of a gyro or of an accelerometer; anything else as it is."""
    from allanite.noise import NoiseModel

    if not isinstance(study, NoiseModel):
        return study
    return {"accelerometer" if study.kind == "acceleration" else "gyro": study}


def _document(study: Any, rate: float | None) -> Mapping[str, Any]:
    if hasattr(study, "to_json"):
        study = study.to_json()
    if not isinstance(study, Mapping) or not study:
        where = "; read a file first: al.Study.load(path), allanite.study.model_file.load_models(path)"
        given = repr(study) if isinstance(study, (str, os.PathLike)) else type(study).__name__
        raise InputError(
            f"export needs a study, a noise model, or a mapping of channel names to noise models, not {given}"
            + (where if isinstance(study, (str, os.PathLike)) else "")
        )
    if not _are_models(study):
        if study.get("format") == "allanite-calibration" or isinstance(study.get("calibration"), Mapping):
            raise InputError("a calibration has no noise: export it with openvins or imu-tk, or pass a study")
        if "channels" not in study or "recording" not in study:
            raise InputError("the document is not a study: it has no 'channels' and 'recording'")
        if rate is not None:
            raise InputError("the study has a sample rate: rate= is for plain noise models")
        return study
    return document_of(study, rate)


def document_of(
    models: Mapping[str, NoiseModel], rate: float | None, provenance: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """What an exporter reads, of bare noise models: `provenance` names their file ("source", "sha256").

    Raises
    ------
    InputError
        No sample rate.
    """
    if rate is None:
        raise InputError("plain noise models have no sample rate: pass rate=")
    channels = [
        {
            "name": name,
            "kind": model.kind,
            "unit": model.unit,
            "models": [m.to_json() for m in model.families],
        }
        for name, model in models.items()
    ]
    return {"provenance": dict(provenance or {}), "recording": {"rate": rate}, "channels": channels}
