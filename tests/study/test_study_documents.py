# SPDX-License-Identifier: BSD-3-Clause
"""Documents of studies: those of version 1 say what they said, and what was studied comes back as it is."""

from __future__ import annotations

import copy
import io
import json
from contextlib import redirect_stdout
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.frozen.doors import report

import allanite as al
from allanite.errors import AllaniteError
from allanite.exporters import export
from allanite.noise import NoiseModel
from allanite.recording.health.finding import Finding
from allanite.views.figures import sheet_of
from allanite.views.report import page_of
from allanite.views.terminal.page import show_document
from bettered import bettered

OLD = sorted((Path(__file__).parent / "documents").glob("study-1-*.json"))
#: Made before the program told how a spectrum was made; its advice is in words of its own.
EARLY = "study-1-early"
NAMES = [place.stem for place in OLD]


def read(place: Path) -> dict[str, Any]:
    document = json.loads(place.read_text(encoding="utf-8"))
    assert isinstance(document, dict)
    return document


@cache
def words_of_old(place: Path) -> str:
    """Everything that page and terminal say of a study of version 1."""
    return words_of(al.Study.load(place))


def words_of(study: al.Study) -> str:
    """Everything that its page and its terminal say."""
    from allanite.views.report import html_of

    out = io.StringIO()
    with redirect_stdout(out):
        show_document(study)
    return " ".join(f"{report(html_of(study))} {out.getvalue()}".split())


def test_there_is_a_document_of_every_kind() -> None:
    studies = [read(place) for place in OLD]
    channels = [c for s in studies for c in s["channels"]]
    parts = {
        key
        for c in channels
        for key in ("environment", "held", "contamination", "floor", "aliasing")
        if key in c
    }
    assert parts == {"environment", "held", "contamination", "floor", "aliasing"}
    assert {len(c["models"]) for c in channels} == {0, 1, 2}
    assert {c["curve"]["statistic"] for c in channels} >= {"oadev", "hdev"}
    assert {c["kind"] for c in channels} >= {"rate", "acceleration", "voltage", "unknown", "phase"}
    assert any("note" in c["slopes"] for c in channels) and any(c["spectrum"]["lines"] for c in channels)
    assert any(f["accepted"] for s in studies for f in s["findings"])
    assert any(s["recording"]["gaps"] for s in studies)
    assert any(s["recording"].get("missing_because") for s in studies)
    assert {s["version"] for s in studies} == {1}


@pytest.mark.long
@pytest.mark.parametrize("place", OLD, ids=NAMES)
def test_a_study_of_version_1_says_what_it_said(place: Path) -> None:
    old, study = read(place), al.Study.load(place)
    said = words_of_old(place)
    for finding in old["findings"]:
        for part in ("message", "advice", "risk"):
            assert finding[part] == "" or getattr(Finding.from_json(finding), part)
    assert study.findings == tuple(Finding.from_json(f) for f in old["findings"])
    for entry, channel in zip(old["channels"], study.channels, strict=True):
        assert list(channel.models) == [NoiseModel.from_json(m) for m in entry["models"]]
        assert channel.curve.deviation.tolist() == pytest.approx(
            [float("nan") if d is None else d for d in entry["curve"]["deviation"]], nan_ok=True, rel=1e-15
        )
        if place.stem != EARLY:
            facts = ("symbol", "target", "reached")
            assert [tuple(getattr(a, f) for f in facts) for a in channel.advice] == [
                tuple(a[f] for f in facts) for a in entry["advice"]
            ]
            for advice, words in zip(channel.advice, (a["text"] for a in entry["advice"]), strict=True):
                if "no record" not in words:  # which says it of either kind
                    assert advice.resolved == ("would stand out" not in words)
        for symbol, slope in entry["slopes"].items():
            note = slope if symbol == "note" else slope["note"] if slope["value"] is not None else ""
            assert " ".join(note.replace("-", "−").split()) in said.replace("-", "−")
        found = entry.get("environment")
        if found is not None:
            assert channel.environment is not None
            assert (channel.environment.verdict, channel.environment.reason) == (
                found["verdict"],
                bettered(found["reason"]),
            )
        if "contamination" in entry:
            assert channel.contamination is not None
            assert channel.contamination.N.lower == entry["contamination"]["N"]["lower"]


@pytest.mark.long
@pytest.mark.parametrize("place", OLD, ids=NAMES)
def test_what_is_written_in_version_2_comes_back_equal(place: Path) -> None:
    study = al.Study.load(place)
    text = json.dumps(study.to_json(), allow_nan=False)
    again = al.Study.from_json(json.loads(text))
    assert json.loads(text)["version"] == 2 and json.dumps(again.to_json(), allow_nan=False) == text
    assert words_of(again) == words_of_old(place)
    titles = {"Verdict", "Curves", "Record", "Spectra"} | ({"Findings"} if study.findings else set())
    assert {s.title for s in page_of(again).sections} >= titles
    for channel in read(place)["channels"]:  # an entry of either version has a figure
        assert sheet_of(channel).panels
    for channel in json.loads(text)["channels"]:
        assert sheet_of(channel).panels


def test_consumers_read_both_versions() -> None:
    document = read(Path(__file__).parent / "documents" / "study-1-six-axes.json")
    study = al.Study.from_json(document)
    for consumer in ("kalibr", "cpp", "vins"):
        assert export(consumer, document) == export(consumer, study) == export(consumer, study.to_json())
    old, other = (
        read(Path(__file__).parent / "documents" / f"study-1-{name}.json") for name in ("one-axis", "lines")
    )
    comparison = al.compare([old, al.Study.from_json(other).to_json()], names=["old", "new"])
    assert (
        comparison.to_json()["channels"]
        == al.compare([old, other], names=["old", "new"]).to_json()["channels"]
    )


def test_no_sentence_of_advice_is_in_a_document() -> None:
    study = al.Study.load(Path(__file__).parent / "documents" / "study-1-one-axis.json")
    (channel,) = study.channels
    text = json.dumps(study.to_json())
    assert channel.advice and all(advice.text not in text for advice in channel.advice)


_ODD: tuple[Any, ...] = (
    None, "x", -1, 0, 1e308, [], {}, [1, "a"], [[1, 2], [3]], True, [None], {"a": 1}, 10**30,
)  # fmt: skip


def _places(value: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where something stands in a document: every key, and the first members of lists."""
    if isinstance(value, dict):
        return [at, *(place for key in value for place in _places(value[key], (*at, key)))]
    if isinstance(value, list):
        return [at, *(place for i, part in enumerate(value[:3]) for place in _places(part, (*at, i)))]
    return [at]


@pytest.mark.long
@pytest.mark.parametrize("name", ["few", "contaminated", "floor", "warm"])
@pytest.mark.parametrize("version", [1, 2])
def test_a_study_that_was_changed_anywhere_is_read_or_refused(name: str, version: int) -> None:
    """One part is missing, or something else: a study that can be written again, or an error that says where."""
    whole = read(Path(__file__).parent / "documents" / f"study-1-{name}.json")
    if version == 2:
        whole = json.loads(json.dumps(al.Study.from_json(whole).to_json()))
    rng = np.random.default_rng([version, len(name)])
    places = [place for place in _places(whole) if place]
    refused = 0
    for _ in range(60):
        document = copy.deepcopy(whole)
        *above, last = places[rng.integers(len(places))]
        box = document
        for key in above:
            box = box[key]
        if isinstance(box, dict) and rng.random() < 0.3:
            del box[last]
        else:
            box[last] = copy.deepcopy(_ODD[rng.integers(len(_ODD))])
        try:
            json.dumps(al.Study.from_json(document).to_json(), allow_nan=False)
        except AllaniteError:
            refused += 1
    assert 6 < refused < 60
