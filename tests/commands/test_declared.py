# SPDX-License-Identifier: BSD-3-Clause
"""Commands that are declared: options that exclude each other, what is required, what the page says of an option."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import allanite as al
from allanite.commands import measure
from allanite.commands.declaration import Command
from allanite.commands.option import option
from allanite.commands.page.kinds import KINDS, described_kinds
from allanite.commands.registry import COMMANDS
from allanite.commands.rules import Conflict, Requirement
from allanite.errors import InputError
from allanite.experiments.earth_rate import EarthRateEstimate, measure_earth_rate
from allanite.files.recording_file import write_recording
from allanite.filtering.simulation import Motion, simulate
from allanite.noise import NoiseModel, White
from allanite.study.result_document import ResultDocument
from shell import Run

LATITUDE = math.radians(48.1)
WORDS = "N=0.1 deg/√h"


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    record = simulate(
        NoiseModel.of(White(N=math.radians(0.1) / 60)), rate=8.0, duration=240.0, seed=1, unit="deg/s",
        motion=Motion.reversals(30.0), latitude=LATITUDE,
    )  # fmt: skip
    return write_recording(record, tmp_path_factory.mktemp("take") / "take.parquet")


def test_options_that_exclude_or_need_each_other_are_named_once() -> None:
    command = Command(
        name="x", title="X", summary="X.", details="", example="", options=(),
        rules=(
            Conflict(one="a", others=("b", "c"), says="not both"),
            Requirement(any_of=("d",), by=("e",), says="e needs d"),
        ),
    )  # fmt: skip
    assert command.refusal({"a": 1, "c": 0.0}) == "not both"
    assert command.refusal({"e": True}) == "e needs d"
    for fine in ({"a": 1}, {"b": 1, "c": 2}, {"a": 1, "b": None, "c": False}, {"d": 1, "e": 1}, {}):
        assert command.refusal(fine) == ""


@pytest.mark.parametrize(
    ("options", "words", "says"),
    [
        ({"turns": "turns.csv", "dwell": 30.0}, ["--turns", "TAKE", "--dwell", "30"], "not both"),
        ({"vector": True, "first": "north"}, ["--vector", "--first", "north"], "three axes at rest"),
        ({"vector": True, "warm_up": True}, ["--vector", "--warm-up"], "three axes at rest"),
    ],
)
def test_the_command_line_and_python_refuse_the_same(
    options: dict[str, object], words: list[str], says: str, take: Path, run: Run
) -> None:
    typed = [str(take) if word == "TAKE" else word for word in words]
    done = run("earth-rate", take, "--latitude", "48.1", *typed)
    assert done.code == 2 and says in done.err
    with pytest.raises(InputError, match=says):
        measure("earth-rate", str(take), latitude=LATITUDE, **options)


def test_a_measurement_that_reads_its_log_itself_is_that_of_the_library(take: Path) -> None:
    stated = {"scale_uncertainty": 0.01, "tilt": 0.002}
    measured = measure(
        "earth-rate", str(take), latitude=LATITUDE, model=WORDS, first="north", confidence=0.9, **stated
    )
    assert isinstance(measured.document, ResultDocument) and isinstance(measured.result, EarthRateEstimate)
    assert measured.result.budget["scale factor"] > measured.result.budget["tilt"] > 0
    assert measured.result.confidence == 0.9 and measured.document.model_name == "given in words"
    bare = measure_earth_rate(al.read(take), latitude=LATITUDE, model=measured.result.model, first="north")
    assert measured.result.rate == pytest.approx(bare.rate, rel=1e-12)
    assert [row["direction"] for row in measured.tables["dwells.csv"]][:2] == ["north", "south"]
    assert measured.document.overview is not None and measured.document.overview.name == "gyro"


def test_what_is_required_is_said_at_every_door(take: Path, run: Run) -> None:
    assert KINDS["earth-rate"].required == ("latitude",)
    done = run("earth-rate", take)
    assert done.code == 2 and "--latitude" in done.err


def test_an_option_says_how_its_word_looks_on_the_command_line_alone(run: Run) -> None:
    typed = " ".join(run("earth-rate", "--help").out.split())
    page = described_kinds()["earth-rate"]["options"]
    stated = "Uncertainty of the latitude"
    assert f"{stated}: 0.01deg." in typed and page["latitude_uncertainty"]["help"] == f"{stated}."
    assert (
        "Uncertainty of the scale factor: 0.1%." in typed
        and "0.001 is 0.1 %" in page["scale_uncertainty"]["help"]
    )
    assert "CSV of turns: start,stop in seconds." in typed and "[[start, stop]" in page["turns"]["help"]
    assert page["turns"]["type"] == "spans" and page["latitude"]["type"] == "degrees"
    assert option("text", "--x", "Help.", detail="like this").detail == "like this"


def test_every_table_of_a_command_has_its_rows() -> None:
    from importlib import import_module

    for command in COMMANDS.values():
        assert bool(command.run) != bool(command.work)
        for dotted in (command.run or command.work, *command.tables.values()):
            module, _, name = dotted.partition(":")
            assert callable(getattr(import_module(module), name))
