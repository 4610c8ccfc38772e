# SPDX-License-Identifier: BSD-3-Clause
"""Study: everything one recording says, as one result with a versioned document.

`allanite.study.characterization` makes it; reports, figures and exporters see it and nothing else.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from allanite.errors import FormatError
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.plain_files.atomic_file import fresh
from allanite.plain_files.json_values import load_plain
from allanite.quantities.result import Result, read_result
from allanite.quantities.tabular import Columns
from allanite.recording.channel_names import channel_called
from allanite.recording.health.finding import Finding
from allanite.study.result_document import Provenance
from allanite.study.results import ChannelStudy, FloorRecord, StudiedRecord, models_by_channel
from allanite.study.version_1 import upgraded

if TYPE_CHECKING:
    pass

__all__ = ["Study"]

_FAULTS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Study(Result):
    """One recording's study.

    Attributes
    ----------
    provenance : Provenance
        Program, command and time that made the study.
    recording : StudiedRecord
        The record.
    findings : tuple of Finding
        Findings about the record, the worst first.
    channels : tuple of ChannelStudy
        Those that bear noise.
    floor : FloorRecord or None
        The record of the shorted input, where one was given.
    """

    FORMAT: ClassVar[str] = "allanite-study"
    VERSION: ClassVar[int] = 2

    provenance: Provenance
    recording: StudiedRecord
    findings: tuple[Finding, ...]
    channels: tuple[ChannelStudy, ...]
    floor: FloorRecord | None = None

    @property
    def result(self) -> Study:
        """Itself: a study is its own document."""
        return self

    @property
    def document(self) -> Mapping[str, object]:
        """The plain document (docs/reference/study-format.md). SI units; numbers that do not exist are null."""
        return self.to_json()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels studied."""
        return tuple(c.name for c in self.channels)

    @property
    def models(self) -> dict[str, NoiseModel]:
        """The noise model of each channel that has one, with its `alternative` where the record cannot decide."""
        return models_by_channel(self.channels)

    def to_columns(self) -> Columns:
        """One row for each parameter of each model: channel, family, term, value, lower, upper, unit, status, note.

        Where the record cannot decide between two families, the preferred one comes first.
        """
        columns: dict[str, list[object]] = {
            name: [] for name in ("channel", "family", *NoiseModel.of().to_columns())
        }
        for channel in self.channels:
            for model in channel.models:
                whose = {"channel": channel.name, "family": model.family}
                repeated = {name: [word] * len(model.estimates) for name, word in whose.items()}
                for name, values in {**repeated, **model.to_columns()}.items():
                    columns[name].extend(values)
        return {**columns}

    def __getitem__(self, name: str) -> ChannelStudy:
        """One channel.

        Raises
        ------
        InputError
            No such channel.
        """
        return channel_called(name, self.channels)

    def __repr__(self) -> str:
        return f"<Study of {self.provenance.source or 'samples in memory'}: {', '.join(self.names)}>"

    @classmethod
    def from_json(cls, data: Mapping[str, object]) -> Study:
        """A study from its document.

        Raises
        ------
        FormatError
            Not a study, a later version, or a part that is missing: all faults at once.
        """
        if data.get("format") != cls.FORMAT:
            raise FormatError(f"not a study: 'format' is {data.get('format')!r}, not {cls.FORMAT!r}")
        if data.get("version") not in (1, cls.VERSION):
            raise FormatError(
                f"this is version {data.get('version')!r} of the study format; this allanite reads versions 1 and "
                f"{cls.VERSION}"
            )
        try:
            return read_result(cls, upgraded(data) if data["version"] == 1 else data)
        except FormatError as faults:
            lines = str(faults).split("\n")[:_FAULTS]
            raise FormatError("the study is damaged:\n" + "\n".join(f"  {line}" for line in lines)) from None

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> Path:
        """Write the document as JSON.

        Raises
        ------
        StorageError
            The file exists and `force` is not set.
        """
        text = json.dumps(self.to_json(), ensure_ascii=False, indent=1, allow_nan=False)
        with fresh(path, force=force) as place:
            place.write_text(text + "\n", encoding="utf-8")
        return Path(path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Study:
        """Read what `save` wrote.

        Raises
        ------
        InputError
            No such file.
        FormatError
            Not JSON, or not a study.
        """
        document = load_plain(path, "a study, study.json of 'allanite characterize LOG'")
        if not isinstance(document, dict):
            raise FormatError(f"{path} is not a study: it contains a {type(document).__name__}")
        return cls.from_json(document)
