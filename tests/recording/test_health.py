# SPDX-License-Identifier: BSD-3-Clause
"""The frame of health: findings, the catalogue, what `check` reads, what `prepare` refuses and leaves out."""

from __future__ import annotations

import inspect
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import DataQualityError, InputError
from allanite.experiments.reversals import listing, remarks, schedule
from allanite.recording.health import examination, held, tails
from allanite.recording.health.catalogue import CATALOGUE, findings_page
from allanite.recording.health.examination import check, prepare
from allanite.recording.health.finding import Finding, Severity
from allanite.recording.health.impulses import Spikes
from allanite.recording.health.tallies import EqualRuns, Extremes, MissingRuns
from allanite.recording.records import BLOCK, Channel, Recording
from noise_records import binomial_bound, flicker, record, walk, white

ROOT = Path(__file__).resolve().parents[2]
HARMLESS = {"resolution_step", "counts"}


def codes(findings: Sequence[Finding]) -> set[str]:
    """Codes of the findings that say something is wrong."""
    return {f.code for f in findings} - HARMLESS


def overloaded(rng: np.random.Generator, count: int, n: int = 20_000) -> Recording:
    samples = white(rng, n) + 40.0
    samples[1000 : 1000 + count] = 9.9e37
    return record(samples)


# -- the catalogue ----------------------------------------------------------------------------------------


def test_the_page_of_findings_is_the_catalogue() -> None:
    page = ROOT / "docs" / "reference" / "findings.md"
    assert page.read_text(encoding="utf-8") == findings_page(), "write it anew: make docs"


def test_every_entry_says_everything() -> None:
    for code, entry in CATALOGUE.items():
        assert code == code.lower()
        assert code.isidentifier()
        assert entry.means, code
        assert entry.done, code
        assert entry.advice, code
        assert set(entry.severity.split(", ")) <= {s.value for s in Severity}
        if "fatal" in entry.severity or "warning" in entry.severity:
            assert entry.risk or code == "unterminated_last_line", f"{code}: what would accepting it risk?"


def test_every_code_in_the_detectors_is_in_the_catalogue_and_back() -> None:
    looks = [
        look
        for name in examination.__all__
        if name.endswith("_DETECTORS")
        for look in getattr(examination, name)
    ]
    source = "".join(inspect.getsource(inspect.getmodule(look)) for look in looks)  # type: ignore[arg-type]
    source += inspect.getsource(held) + inspect.getsource(tails)
    elsewhere = {  # made by allanite.study
        "spectral_line",
        "band_limited",
        "not_fitted",
        "short_lags_left_out",
        "model_discrepancy",
        "lag_and_frequency_disagree",
        "floor_taken_off",
        "floor_dominates",
    }
    turns = "".join(inspect.getsource(module) for module in (remarks, listing, schedule))
    elsewhere |= {code for code, entry in CATALOGUE.items() if entry.group in ("Turns", "Environment")}
    for code, entry in CATALOGUE.items():
        assert (f'"{code}"' in source) is (code not in elsewhere), code
        assert entry.group != "Turns" or f'"{code}"' in turns, code


# -- findings ---------------------------------------------------------------------------------------------


def test_a_finding_survives_json(rng: np.random.Generator) -> None:
    found = check(overloaded(rng, 100))
    fatal = next(f for f in found if f.code == "overload")
    again = Finding.from_json(json.loads(json.dumps(fatal.to_json())))
    assert again == fatal
    assert again.places == ((1000, 1100),)
    assert "spans" not in fatal.to_json()


@pytest.mark.parametrize("damage", [{"severity": "grave"}, {"places": [[1]]}, {"count": None}])
def test_json_that_is_no_finding_is_refused(rng: np.random.Generator, damage: dict[str, object]) -> None:
    data = check(overloaded(rng, 100))[0].to_json() | damage
    with pytest.raises(InputError, match="not a finding"):
        Finding.from_json(data)


def test_findings_are_frozen_and_the_gravest_comes_first(rng: np.random.Generator) -> None:
    samples = white(rng, 20_000) + 40.0
    samples[0] = np.nan
    samples[100:200] = np.inf
    found = check(record(samples, unit="unknown"))
    assert [f.severity.rank for f in found] == sorted(f.severity.rank for f in found)
    assert found[0].code == "overload"
    with pytest.raises(AttributeError):
        found[0].count = 3  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        found[0].spans[0, 0] = 3


def test_what_all_channels_share_is_said_once(rng: np.random.Generator) -> None:
    samples = rng.standard_normal((20_000, 3)) + [5.0, 6.0, 7.0]
    samples[500:700] = np.nan
    found = [f for f in check(record(samples, unit="unknown")) if f.code == "missing"]
    assert [(f.channel, f.count) for f in found] == [(None, 200)]
    samples[800, 1] = np.nan
    found = [f for f in check(record(samples, unit="unknown")) if f.code == "missing"]
    assert sorted((str(f.channel), f.count) for f in found) == [("x", 200), ("y", 201), ("z", 200)]


# -- prepare ----------------------------------------------------------------------------------------------


def test_a_fatal_finding_refuses_and_says_how_to_go_on(rng: np.random.Generator) -> None:
    recording = replace(overloaded(rng, 100), source="run7.csv")
    with pytest.raises(DataQualityError) as refusal:
        prepare(recording, check(recording))
    text = str(refusal.value)
    for part in ("run7.csv", "overload [signal]", "10 s (sample 1000)", "count 100", "--accept overload"):
        assert part in text
    assert CATALOGUE["overload"].risk in text
    assert [f.code for f in refusal.value.findings] == ["overload"]  # type: ignore[attr-defined]


def test_accepting_it_goes_on_and_says_so(rng: np.random.Generator) -> None:
    recording = overloaded(rng, 100)
    prepared, findings = prepare(recording, check(recording), accept=["overload"])
    said = next(f for f in findings if f.code == "overload")
    assert said.accepted
    assert said.excludes
    assert np.isnan(prepared.values("signal")[1000:1100]).all()
    assert np.isnan(prepared.values("signal")).sum() == 100
    step = {"step": "exclude", "reason": "overload", "samples": {"signal": 100}}
    assert prepared.history == (*recording.history, step)


def test_an_unknown_code_is_refused_with_the_list(rng: np.random.Generator) -> None:
    recording = record(white(rng, 1000))
    with pytest.raises(InputError, match=r"'overlaod'.*there are: no_samples, .*overload"):
        prepare(recording, check(recording), accept=["overlaod"])


def test_a_clean_recording_passes_unchanged(rng: np.random.Generator) -> None:
    recording = record(white(rng, 20_000) + 3.0)
    prepared, findings = prepare(recording, check(recording))
    assert findings == ()
    assert prepared is recording


def test_a_channel_without_samples_is_left_out_when_accepted(rng: np.random.Generator) -> None:
    samples = rng.standard_normal((20_000, 3)) + [5.0, 6.0, 7.0]
    samples[:, 1] = np.nan
    recording = record(samples, unit="V")
    found = check(recording)
    with pytest.raises(DataQualityError, match=r"no_samples \[y\]"):
        prepare(recording, found)
    prepared, _ = prepare(recording, found, accept="no_samples")
    assert prepared.names == ("x", "z")
    assert prepared.history[-1]["left_out"] == ["y"]


def test_nothing_left_is_refused_even_if_accepted() -> None:
    recording = record(np.full(5000, np.nan))
    with pytest.raises(DataQualityError, match="nothing to analyze"):
        prepare(recording, check(recording), accept=["no_samples"])


# -- how it reads -----------------------------------------------------------------------------------------


class Made:
    """A column that makes its samples when asked: longer than would be read at once."""

    def __init__(self, length: int) -> None:
        self.length, self.asked = length, list[tuple[int, int]]()

    origin = 0.0
    dtype = np.dtype(np.float32)

    def __len__(self) -> int:
        return self.length

    def read(self, start: int, stop: int) -> np.ndarray:
        self.asked.append((start, stop))
        block = np.random.default_rng(start).standard_normal(stop - start).astype(np.float32)
        return block.astype(np.float64) + 5.0


def test_a_channel_is_read_once_in_blocks_with_progress() -> None:
    column = Made(5 * BLOCK + 1234)
    heater = Made(5 * BLOCK + 1234)
    channels = (Channel.of("a", "m/s^2"), Channel.of("temperature", "degC"))
    recording = Recording(channels=channels, columns=(column, heater), rate=200.0)
    seen: list[float] = []
    assert codes(check(recording, progress=seen.append)) == set()
    blocks = [(a, min(a + BLOCK, len(column))) for a in range(0, len(column), BLOCK)]
    assert column.asked[: len(blocks)] == blocks
    assert all(b - a <= 4096 for a, b in column.asked[len(blocks) :])  # a look at the end
    assert heater.asked == []  # a temperature bears no noise model
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


@pytest.mark.parametrize("cut", [1, 7, 50, 10_000])
def test_tallies_do_not_depend_on_the_blocks(rng: np.random.Generator, cut: int) -> None:
    samples = np.round(white(rng, 10_000) * 2.0) / 2.0
    samples[300:320] = np.nan
    samples[4998:5041] = [-9.0, *[0.5] * 41, 9.0]
    missing, equal, high = MissingRuns(10), EqualRuns(), Extremes(+1)
    last = np.nan
    for start in range(0, len(samples), cut):
        block = samples[start : start + cut]
        mask = np.isnan(block)
        same = np.diff(block, prepend=last) == 0.0
        last = block[-1]
        missing.add(mask if mask.any() else None, start)
        equal.add(same, start)
        high.add(block, ~same)
    missing.close(len(samples))
    equal.close(len(samples))
    assert (missing.count, missing.n_runs, missing.spans.tolist()) == (20, 1, [[300, 320]])
    assert missing.longest == 9680
    assert [4999, 5040] in equal.spans.tolist()
    lengths = equal_lengths(samples)
    assert equal.histogram[2:].tolist() == np.bincount(lengths, minlength=1025)[2:].tolist()
    values, counts = np.unique(samples[~np.isnan(samples)], return_counts=True)
    assert high.result().values.tolist() == values[::-1][:8].tolist()
    assert high.result().samples.tolist() == counts[::-1][:8].tolist()


def equal_lengths(samples: np.ndarray) -> list[int]:
    """Lengths of all runs of two or more equal samples, one by one."""
    lengths, run = [], 1
    for one, two in zip(samples[:-1], samples[1:], strict=True):
        if one == two:
            run += 1
        elif run > 1:
            lengths.append(run)
            run = 1
    return [*lengths, run] if run > 1 else lengths


def test_spikes_at_the_edges_of_blocks_are_seen(rng: np.random.Generator) -> None:
    samples = white(rng, 4000)
    samples[[0, 999, 1000, 3999]] += 60.0
    spikes, last = Spikes(4000, False), np.nan
    for start in range(0, 4000, 1000):
        block = samples[start : start + 1000]
        spikes.add(block, np.diff(block, prepend=last), start)
        last = block[-1]
    assert spikes.result().position.tolist() == [0, 999, 1000, 3999]


# -- false alarms -----------------------------------------------------------------------------------------

#: Designed false alarms per record: impulses 1e-3, rest 1e-4, stuck 1e-4, amplitude 1e-4, clipping 2e-6.
DESIGNED = 1.4e-3


def clean_records(seed: int) -> list[tuple[str, np.ndarray]]:
    rng = np.random.default_rng([20261121, seed])
    n = 20_000
    noise = white(rng, n)
    smooth, smoother = (np.convolve(noise, np.hanning(k + 2)[1:-1], "same") for k in (7, 31))
    return [
        ("white", noise + 12.0),
        ("white, flicker, walk", noise + 0.3 * flicker(rng, n) + walk(rng, n, 0.01)),
        ("walk above the white noise", noise + walk(rng, n, 0.3)),
        ("pure flicker", flicker(rng, n)),
        ("pure walk", walk(rng, n, 1.0)),
        ("low-pass filtered", smooth),
        ("low-pass filtered at a twentieth of the rate", smoother),
        ("steps of 0.4 sigma", np.round(noise / 0.4 + walk(rng, n, 0.05)) * 0.4),
        ("float32 at 9.81", (1e-3 * noise + 9.81).astype(np.float32)),
        ("int16 counts", np.round(30.0 * noise + 500.0).astype(np.int16)),
        ("text with three decimals", np.round(noise + 37.3, 3)),
    ]


@pytest.mark.long
def test_clean_noise_raises_no_alarm() -> None:
    alarms, trials = [], 0
    for seed in range(6):
        for name, samples in clean_records(seed):
            trials += 1
            alarms += [(name, seed, f) for f in check(record(samples)) if f.code not in HARMLESS]
    assert len(alarms) <= binomial_bound(trials, DESIGNED), [f"{n} {s}: {f}" for n, s, f in alarms]


@pytest.mark.long
def test_a_long_clean_record_raises_no_alarm() -> None:
    rng = np.random.default_rng(7)
    n = 1_500_000
    samples = white(rng, n) + 0.2 * flicker(rng, n) + walk(rng, n, 0.003) + 30.0
    assert check(record(samples)) == ()
