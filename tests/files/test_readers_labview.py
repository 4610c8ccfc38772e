# SPDX-License-Identifier: BSD-3-Clause
"""LabVIEW measurement files (.lvm): the header names channels, units and the clock."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import FormatError, InputError
from allanite.files.readers import read
from shell import Run

N = 60
CHANNELS = (("Gyro X", "deg/s"), ("Acc Z", "m/s^2"), ("Temperature", "°C"), ("Bridge", "V"))


@dataclass(frozen=True, kw_only=True)
class File:
    """How such a file is written."""

    sign: str = "\t"
    decimal: str = "."
    columns: str = "One"
    headings: bool = False
    segments: int = 1
    pause: float = 0.0
    comments: bool = False
    special: bool = False
    goes_on: bool = False
    channels: int = 2
    deltas: tuple[float, ...] = ()
    tags: tuple[str, ...] = ()
    dimension: str = "Time"

    def number(self, value: float) -> str:
        return f"{value:.6f}".replace(".", self.decimal)

    def write(self, path: Path, y: np.ndarray) -> Path:
        known = CHANNELS[: self.channels]
        rows: list[list[str]] = [
            ["LabVIEW Measurement", ""], ["Writer_Version", "2"], ["Reader_Version", "2"],
            ["Separator", {"\t": "Tab", ",": "Comma"}[self.sign]], ["Decimal_Separator", self.decimal],
            ["Multi_Headings", "Yes" if self.headings else "No"], ["X_Columns", self.columns],
            ["Time_Pref", "Absolute"], ["Date", "2024/01/31"], ["Time", f"12:05:01{self.decimal}25"],
            ["***End_of_Header***", ""], [""],
        ]  # fmt: skip
        deltas = self.deltas or (0.01,) * self.channels
        for s in range(self.segments):
            later = s * (N * 0.01 + self.pause)
            x0 = later if self.goes_on else 0.0
            if s == 0 or self.headings:
                clock = f"12:05:{1.25 + (0.0 if self.goes_on else later):09.6f}".replace(".", self.decimal)
                if self.special:
                    rows += [
                        ["***Start_Special***"],
                        ["Ref_Num", "1"],
                        ["1", "2", "3"],
                        ["***End_Special***"],
                    ]
                for word, cells in (
                    ("Channels", [str(self.channels)]),
                    ("Samples", [str(N)] * self.channels),
                    ("Date", ["2024/01/31"] * self.channels),
                    ("Time", [clock] * self.channels),
                    ("Y_Unit_Label", [unit for _, unit in known]),
                    ("X_Dimension", [self.dimension] * self.channels),
                    ("X0", [self.number(x0) + "E+0"] * self.channels),
                    ("Delta_X", [self.number(delta) for delta in deltas]),
                ):
                    rows += [] if word in self.tags else [[word, *cells, ""]]
                rows.append(["***End_of_Header***", *[""] * self.channels])
                names = [cell for name, _ in known for cell in ("X_Value", name)]
                rows.append(names if self.columns == "Multi" else ["X_Value", *(name for name, _ in known)])
                rows[-1].append("Comment")
            for k in range(N):
                x = self.number((x0 if self.headings else later) + k * 0.01)
                values = [self.number(value) for value in y[s * N + k]]
                row = [cell for value in values for cell in (x, value)]
                if self.columns != "Multi":
                    row = ["" if self.columns == "No" else x, *values]
                rows.append([*row, "began here"] if self.comments and k == 0 else row)
        path.write_text("\r\n".join(self.sign.join(row) for row in rows) + "\r\n", encoding="utf-8")
        return path


def test_names_units_and_clock_are_those_of_the_header(tmp_path: Path) -> None:
    for seed in range(40):
        rng = np.random.default_rng([73, seed])
        sign = "," if rng.random() < 0.2 else "\t"
        segments = int(rng.choice([1, 1, 3]))
        written = File(
            sign=sign,
            decimal="," if sign == "\t" and rng.random() < 0.5 else ".",
            columns=str(rng.choice(["No", "One", "Multi"])),
            headings=segments > 1,
            segments=segments,
            pause=float(rng.choice([0.0, 0.5])),
            comments=bool(rng.random() < 0.5),
            special=bool(rng.random() < 0.3),
            goes_on=bool(rng.random() < 0.3),
            channels=int(rng.integers(1, 5)),
        )
        y = np.round(rng.standard_normal((N * segments, written.channels)), 6)
        recording = read(written.write(tmp_path / f"{seed}.lvm", y))
        known = CHANNELS[: written.channels]
        assert [c.name for c in recording.channels] == [name.replace(" ", "_") for name, _ in known], written
        assert [c.unit for c in recording.channels] == [unit for _, unit in known], written
        assert recording.rate == pytest.approx(100.0), written
        assert recording.start == 1_706_702_701_250_000_000, written
        pause = round(written.pause * 100) if segments > 1 else 0
        assert recording.n_samples == N * segments + pause * (segments - 1), written
        for k, name in enumerate(recording.names):
            raw = recording.values(name)
            assert np.allclose(raw[np.isfinite(raw)], y[:, k], atol=1e-5), (written, name)


def test_several_segments_under_one_header(tmp_path: Path) -> None:
    y = np.round(np.random.default_rng(1).standard_normal((3 * N, 2)), 6)
    recording = read(File(segments=3).write(tmp_path / "a.lvm", y))
    assert (recording.rate, recording.n_samples) == (100.0, 3 * N)


def test_channels_with_clocks_of_their_own_are_read_one_by_one(run: Run, tmp_path: Path) -> None:
    y = np.zeros((N, 2)) + np.arange(N)[:, None] % 7
    log = File(columns="Multi", deltas=(0.01, 0.02)).write(tmp_path / "a.lvm", y)
    refused = run("info", str(log))
    assert refused.code == 1
    ways = re.findall(r"--variable '[^']+'", refused.err)
    assert len(ways) == 2
    for way in ways:
        done = run("info", str(log), *shlex.split(way))
        assert done.code in (0, 1, 3) and "samples" in done.out, way


def test_what_is_no_log_is_refused(tmp_path: Path) -> None:
    y = np.zeros((2 * N, 2))
    with pytest.raises(FormatError, match="not time"):
        read(File(dimension="Frequency").write(tmp_path / "a.lvm", y))
    with pytest.raises(FormatError, match="no Delta_X"):
        read(File(columns="No", tags=("Delta_X",)).write(tmp_path / "b.lvm", y))
    with pytest.raises(InputError, match="no channel 'Mag'"):
        read(File().write(tmp_path / "c.lvm", y), variable="Mag")
    whole = File(segments=2, headings=True).write(tmp_path / "d.lvm", y).read_text(encoding="utf-8")
    (tmp_path / "d.lvm").write_text(whole.replace("Acc Z", "Acc Y", 1), encoding="utf-8")
    with pytest.raises(FormatError, match="segment 2 differs from the first one in channels"):
        read(tmp_path / "d.lvm")
    (tmp_path / "e.lvm").write_text(whole[: whole.index("Y_Unit")], encoding="utf-8")
    with pytest.raises(FormatError, match="without the header of a segment"):
        read(tmp_path / "e.lvm")
