# SPDX-License-Identifier: BSD-3-Clause
"""The exported bias filter: its text, and what the C++ example makes of it on a desk and for a Cortex-M4."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from verification.firmware import RATE, constants, replayed, space_of

import allanite as al
from allanite.errors import InputError
from allanite.exporters import cpp
from allanite.filtering.kalman import merged, run_filter, steady_state
from allanite.filtering.kalman.filtering import FilterRun
from allanite.noise import (
    SIGMA_PER_B,
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    RandomWalk,
    StateSpace,
    White,
)
from shell import Run

ROOT = Path(__file__).resolve().parents[2]
#: The head and the constants of a model; between them stand headers of the kernels, behind them `bias_filter.hpp`.
GOLDEN = Path(__file__).parents[1] / "published" / "cpp_model.hpp"
FILTERS = "// -- the filter ---"
LICENCE = "// SPDX-License-Identifier: BSD-3-Clause\n"
DEG = math.radians(1)

#: The example in the folder firmware: 0.3 deg/sqrt(h), 5 deg/h, 5 deg/h/sqrt(h) at 100 Hz, flicker over 10 min.
GYRO = NoiseModel.of(White(N=0.3 * DEG / 60), Flicker(B=5 * DEG / 3600), RandomWalk(K=5 * DEG / 3600 / 60))
EXAMPLE: dict[str, Any] = {"rate": 100.0, "horizon": 600.0}


def exported(model: Any = GYRO, **options: Any) -> str:
    given = model if isinstance(model, dict) else {"gyro": model}
    return al.export("cpp", given, **{**EXAMPLE, **options})


def fitted(name: str, *terms: Any, estimates: Any = (), kind: str = "rate") -> dict[str, Any]:
    model = {**NoiseModel.of(*terms, kind=kind).to_json(), "family": "flicker", "estimates": list(estimates)}
    return {"name": name, "kind": kind, "unit": "rad/s", "models": [model]}


def estimate(symbol: str, value: float | None, lower: float, upper: float | None) -> dict[str, Any]:
    known = value is not None
    return {"symbol": symbol, "value": value, "lower": lower, "upper": upper, "supported": known, "note": ""}


def study(*channels: dict[str, Any], sampling: str = "mean") -> dict[str, Any]:
    facts = [{"name": c["name"], "kind": c["kind"], "sampling": sampling} for c in channels]
    return {
        "provenance": {"source": "lab bench.csv", "sha256": "ab" * 32},
        "recording": {"rate": 200.0, "duration": 7200.0, "channels": facts},
        "channels": list(channels),
    }


def without_arithmetic(text: str) -> str:
    """The text without the headers of the kernels that it holds."""
    head, _, rest = text.partition("// -- allanite/")
    return head + rest[rest.index("namespace sensor {") :]


# -- the numbers ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampling", ["mean", "point"])
@pytest.mark.parametrize(
    "model",
    [
        GYRO,
        NoiseModel.of(White(N=1e-4), Flicker(B=2e-5)),
        NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(3e-5, 20.0)),
        NoiseModel.of(
            White(N=1e-4), GaussMarkov.from_sigma(3e-5, 20.0), RandomWalk(K=1e-6), Quantisation(Q=1e-6)
        ),
        NoiseModel.of(White(N=1e-4)),
    ],
    ids=str,
)
def test_exported_filter_is_the_model_with_an_unknown_level(
    model: NoiseModel, sampling: str, rng: np.random.Generator
) -> None:
    """Same bias, same variance, same innovations as the filter of the noise model and a diffuse constant."""
    text = exported(model, scalar="double", sampling=sampling)
    small, start = space_of(text), constants(text)["start_gain"]
    y = 0.3 + 1e-3 * rng.standard_normal(500)
    y[100:150] = np.nan
    whole = model.state_space(0.01, sampling=sampling, record=600.0).with_constant()
    truth = run_filter(y, whole, readout=[whole.rate])
    # The start is the state after the first sample: continue from its prediction.
    f = small.transition
    later = StateSpace(
        **{
            **{
                k: getattr(small, k)
                for k in ("transition", "process", "output", "noise", "rate", "labels", "diffuse")
            },
            "initial": f @ small.initial @ f.T + small.process,
        }
    )
    found = run_filter(y[1:], later, readout=[small.rate], state=f @ (start * y[0]))
    assert found.readout == pytest.approx(truth.readout[1:], rel=1e-9, abs=1e-12)
    assert found.readout_sd == pytest.approx(truth.readout_sd[1:], rel=1e-9)
    assert found.innovations == pytest.approx(truth.innovations[1:], rel=1e-6, abs=1e-12, nan_ok=True)


def test_steady_gain_is_that_of_the_settled_filter() -> None:
    text = exported(scalar="double")
    space, c = space_of(text), constants(text)
    settled = steady_state(space)
    assert c["steady_gain"] == pytest.approx(settled.gain, rel=1e-9)
    assert c["steady_innovation_sd"][0] == pytest.approx(math.sqrt(settled.innovation_variance), rel=1e-9)
    assert "steady_gain" not in constants(exported(NoiseModel.of(White(N=1e-4))))
    assert "No steady gain" in exported(NoiseModel.of(White(N=1e-4)))


@pytest.mark.long
@pytest.mark.parametrize("rate", [0.01, 0.3, 20.0])
def test_steady_sd_is_that_of_the_bias_that_both_filters_return(rate: float) -> None:
    """The running filter's bias, a prediction for the next sample, has it in the end: at slow rates too."""
    model = NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-5))
    text = exported(model, scalar="double", rate=rate, horizon=1e5)
    space, c = space_of(text), constants(text)
    run = FilterRun(space)
    run.feed(
        np.zeros(20_000), readout=False, innovations=False
    )  # ends with the prediction for the next sample
    assert c["steady_sd"][0] == pytest.approx(math.sqrt(space.rate @ run.covariance @ space.rate), rel=1e-9)
    if shutil.which("g++") and shutil.which("make"):
        variance = replayed(text, np.zeros(20_000), every=20_000)[-1, 1]
        assert c["steady_sd"][0] == pytest.approx(math.sqrt(variance), rel=1e-9)


@pytest.mark.parametrize("options", [{}, {"flicker": "single", "correlation_time": 100.0}], ids=str)
def test_steady_gain_solves_the_riccati_equation_and_is_the_limit_of_the_running_one(
    options: dict[str, Any],
) -> None:
    """Two more witnesses: SciPy's solution of the equation, and the filter's own gain after a long time."""
    from scipy.linalg import solve_discrete_are

    text = exported(scalar="double", filter_rate=1.0, rate=1.0, **options)
    space, gain = space_of(text), constants(text)["steady_gain"]
    size = np.sqrt(np.where(np.diag(space.process) > 0, np.diag(space.process), space.noise))
    f = space.transition * size / size[:, None]
    h, q = space.output * size, space.process / np.outer(size, size)
    p = solve_discrete_are(f.T, h[:, None], q, [[space.noise]])
    assert gain == pytest.approx(size * (p @ h) / (h @ p @ h + space.noise), rel=1e-6)
    late = FilterRun(space)
    late.feed(np.zeros(400_000), readout=False, innovations=False)
    p = late.covariance
    assert gain == pytest.approx(p @ space.output / (space.output @ p @ space.output + space.noise), rel=1e-6)


def test_states_are_few_and_counted() -> None:
    for options, count in (
        ({}, 9),
        ({"flicker": "single", "correlation_time": 100.0}, 3),
        ({"flicker": "single", "correlation_time": 100.0, "sampling": "point"}, 2),
        ({"filter_rate": 1.0}, 7),
    ):
        text = exported(**options)
        assert constants(text)["n_states"] == count
        assert len(re.findall(r"^//   \d+: ", text, re.M)) == count
    single = exported(flicker="single", correlation_time=100.0, scalar="double")
    own = GYRO.terms[0], GaussMarkov.from_sigma(SIGMA_PER_B * 5 * DEG / 3600, 100.0), GYRO.terms[2]
    same = merged(NoiseModel.of(*own).state_space(0.01))
    assert space_of(single).process == pytest.approx(same.process, rel=1e-12)


def test_golden_file() -> None:
    limits = [
        estimate("N", 8.7e-5, 8.6e-5, 8.8e-5),
        estimate("B", 2.4e-5, 2.2e-5, 2.7e-5),
        estimate("K", None, 0, 4e-7),
    ]
    channels = [
        fitted("gx", White(N=8e-5), Flicker(B=2e-5)),
        fitted("gy", White(N=8.7e-5), Flicker(B=2.4e-5), estimates=limits),
    ]
    text = al.export("cpp", study(*channels), filter_rate=10.0, horizon=100.0)
    model, _, filters = without_arithmetic(text).partition(FILTERS)
    assert LICENCE + model.replace(al.__version__, "VERSION") == GOLDEN.read_text(encoding="utf-8")
    written = Path(cpp.__file__).with_name("bias_filter.hpp").read_text(encoding="utf-8")
    assert filters == written.partition(FILTERS)[2] + "\n}  // namespace sensor\n\n#endif\n"


def test_it_holds_the_arithmetic_of_the_kernels_word_by_word_each_header_once() -> None:
    text = exported()
    names = re.findall(r"^// -- allanite/(\w+\.hpp) ---$", text, re.M)
    assert {"bits.hpp", "slice.hpp", "kalman.hpp", "diffuse.hpp", "square_root.hpp"} == set(names) and len(
        names
    ) == 5
    for name in names:
        lines = (ROOT / "kernels" / "include" / "allanite" / name).read_text(encoding="utf-8").splitlines()
        assert "\n".join(x for x in lines if not x.startswith('#include "')) in text
    assert set(re.findall("#include (.*)", text)) == {"<math.h>", "<stddef.h>", "<stdint.h>"}


def test_a_term_is_said_to_be_left_out_only_where_the_filter_does_without_it() -> None:
    """A record can need slow noise and not tell which: the fit then holds a term that it does not resolve."""
    limits = [estimate("B", None, 0, 3e-5), estimate("K", None, 0, 4e-7), estimate("R", None, 0, 1e-9)]
    for terms, held in (
        ([White(N=8e-5), RandomWalk(K=3e-7)], {"K"}),
        ([White(N=8e-5), Flicker(B=2e-5)], {"B"}),
        ([White(N=8e-5), Flicker(B=2e-5), RandomWalk(K=3e-7)], {"B", "K"}),
        ([White(N=8e-5)], set()),
    ):
        for options in ({}, {"flicker": "single", "correlation_time": 50.0}):
            if options and "B" not in held:
                continue
            text = al.export("cpp", study(fitted("g", *terms, estimates=limits)), **options)
            out = set(re.findall(r"^// noise: (\w+) < .* NOT in this filter$", text, re.M))
            assert out == {"B", "K", "R"} - held
            assert set(re.findall(r"^// noise: (\w+) < .*, in this filter as above", text, re.M)) == held


def test_example_in_the_folder_is_up_to_date() -> None:
    kept = (ROOT / "firmware" / "model.hpp").read_text(encoding="utf-8")
    version = re.compile(r"allanite \d+\.\d+\.\d+\S*")
    assert version.sub("allanite", kept) == LICENCE + version.sub("allanite", exported())


# -- choices ----------------------------------------------------------------------------------------------------


def test_worst_axis_is_the_default_and_any_can_be_named() -> None:
    axes = [
        fitted("x", White(N=1e-4)),
        fitted("y", White(N=2e-4)),
        fitted("z", White(N=1e-4), RandomWalk(K=1e-9)),
    ]
    acceleration = fitted("a", White(N=1.0), kind="acceleration")
    document = study(acceleration, *axes)
    assert "channel y, the worst axis of 3 channels of its kind:" in al.export("cpp", document)
    assert "channel z, one of 4" in al.export("cpp", document, channel="z")
    named = al.export("cpp", document, channel="a")
    assert "[(m/s^2)^2]" in named
    drifting = study(*axes, fitted("w", White(N=1e-4), Flicker(B=1e-3)))
    assert "channel w, the worst" in al.export("cpp", drifting)


def test_rate_sampling_and_family_are_said() -> None:
    document = study(fitted("x", White(N=1e-4), Flicker(B=1e-5)), sampling="point")
    assert "the value at an instant" in al.export("cpp", document)
    slower = al.export("cpp", document, filter_rate=10.0)
    assert "FEED MEANS" in slower
    assert "the mean over its interval" in slower
    assert "EXTRAPOLATED" in al.export("cpp", document, filter_rate=400.0)
    assert "in float, feed means at a lower rate" in al.export("cpp", document, horizon=1e6)
    other = {**NoiseModel.of(White(N=1e-4), GaussMarkov(q=1e-6, T=50.0)).to_json(), "family": "gauss-markov"}
    both = study({**document["channels"][0], "models": [*document["channels"][0]["models"], other]})
    assert "cannot decide" in al.export("cpp", both)
    assert "of the family flicker, which drifts more over" in al.export("cpp", both)
    reddest = {
        **NoiseModel.of(White(N=1e-4), GaussMarkov(q=1e-4, T=500.0)).to_json(),
        "family": "gauss-markov",
    }
    last = study({**document["channels"][0], "models": [*document["channels"][0]["models"], reddest]})
    assert "of the family gauss-markov, which drifts more over" in al.export("cpp", last)
    chosen = al.export("cpp", both, family="gauss-markov")
    assert constants(chosen)["n_states"] == 3
    with pytest.raises(InputError, match="no model of the family 'pink'; there are: flicker, gauss-markov"):
        al.export("cpp", both, family="pink")


def test_user_text_stays_in_its_comment() -> None:
    text = exported({"ω\nint x; \\": GYRO})
    assert text.isascii()
    before = text[: text.index("#ifndef")]
    assert all(line.startswith("// ") and not line.endswith("\\") for line in before.splitlines())


@pytest.mark.parametrize(
    ("channels", "options", "message"),
    [
        ([fitted("g", White(N=1.0))], {"channel": "h"}, "no channel 'h' with a noise model; there are: g"),
        ([{**fitted("g", White(N=1.0)), "models": []}], {}, "has no noise model"),
        ([fitted("g", RandomWalk(K=0.0))], {}, "no white noise"),
        ([fitted("g", White(N=1.0))], {"scalar": "half"}, "'float' or 'double'"),
        ([fitted("g", White(N=1.0))], {"namespace": "a b"}, "C\\+\\+ namespace"),
        ([fitted("g", White(N=1.0))], {"namespace": "class"}, "C\\+\\+ namespace"),
        ([fitted("g", White(N=1.0))], {"namespace": "std"}, "C\\+\\+ namespace"),
        ([fitted("g", White(N=1.0))], {"filter_rate": 0.0}, "filter_rate must be a positive"),
        ([fitted("g", White(N=1.0))], {"horizon": math.inf}, "horizon must be a positive"),
        ([fitted("g", White(N=1.0))], {"sampling": "raw"}, "'mean' or 'point'"),
        (
            [fitted("g", White(N=1.0))],
            {"flicker": "single", "correlation_time": 1.0},
            "the model has no flicker",
        ),
        ([fitted("g", White(N=1.0), Flicker(B=1.0))], {"flicker": "single"}, "needs correlation_time="),
        ([fitted("g", White(N=1.0), Flicker(B=1.0))], {"correlation_time": 1.0}, "flicker='single'"),
    ],
)
def test_refusals(channels: list[dict[str, Any]], options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        al.export("cpp", study(*channels), **options)


# -- the example ------------------------------------------------------------------------------------------------


def make(target: str, folder: Path, **variables: str) -> str:
    given = [f"{k}={v}" for k, v in {"BUILD": str(folder), **variables}.items()]
    done = subprocess.run(
        ["make", "-s", "-C", str(ROOT / "firmware"), target, *given],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(not (shutil.which("g++") and shutil.which("make")), reason="needs g++ and make")
@pytest.mark.parametrize(("scalar", "bound"), [("double", 1e-9), ("float", 2e-3)])
def test_example_on_a_desk_gives_what_python_gives(scalar: str, bound: float, tmp_path: Path) -> None:
    """Errors are judged in standard deviations of the bias; float must also keep 1e-6 of the sample."""
    (tmp_path / "model.hpp").write_text(exported(scalar=scalar), encoding="utf-8")
    make("host", tmp_path, MODEL=str(tmp_path))
    printed = subprocess.run(
        [tmp_path / "host", "4000"], capture_output=True, text=True, timeout=60, check=True
    ).stdout
    y, innovation, bias, variance, fixed = np.array(
        [line.split() for line in printed.splitlines()], dtype=float
    ).T
    space = GYRO.state_space(0.01, record=600.0).with_constant()
    ahead = space.rate @ space.transition
    result = run_filter(y, space, readout=[ahead])
    driven = float(space.rate @ space.process @ space.rate)
    first = int(np.isfinite(y).argmax())
    assert (bias[:first] == 0).all()
    assert np.isnan(variance[:first]).all()
    sd = np.sqrt(result.readout_sd[:, 0] ** 2 + driven)[first:]
    error = (bias[first:] - result.readout[first:, 0]) / sd
    assert np.abs(error).max() < bound
    assert np.abs(error * sd).max() < 1e-6 * 10 * np.nanmax(np.abs(y))
    assert np.sqrt(variance[first:]) == pytest.approx(sd, rel=bound)
    assert innovation == pytest.approx(result.innovations, abs=bound * sd.max(), nan_ok=True)
    # the fixed gain, which begins at the first sample and forgets it with the slowest states
    c = constants(exported(scalar="double"))
    s, f, path = c["start_gain"] * y[first], c["transition"].reshape(9, 9), []
    for sample in y[first:]:
        s = f @ (s + (0 if math.isnan(sample) else (sample - c["output"] @ s) * c["steady_gain"]))
        path.append(c["bias_of_states"] @ s)
    assert fixed[first:] == pytest.approx(path, rel=1e-5)


@pytest.mark.skipif(not (shutil.which("g++") and shutil.which("make")), reason="needs g++ and make")
@pytest.mark.parametrize(("scalar", "bound"), [("double", 1e-9), ("float", 5e-3)])
def test_states_after_a_quarter_of_an_hour_are_those_of_python(
    scalar: str, bound: float, rng: np.random.Generator
) -> None:
    """All states of a model without K, which has a constant bias and no steady gain; `make verify` takes a day."""
    model = NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(3e-5, 20.0))
    text = exported(model, scalar=scalar, rate=RATE, horizon=600.0)
    assert "FixedGainFilter" not in text
    y = 1e-3 + 1e-3 * rng.standard_normal(round(900 * RATE))
    y[5000:9000] = np.nan
    found = replayed(text, y, every=len(y))[-1]
    small = space_of(exported(model, scalar="double", rate=RATE, horizon=600.0))
    whole = model.state_space(1 / RATE, record=600.0).with_constant()
    truth = run_filter(y, whole, store=False)
    sd = math.sqrt(whole.rate @ truth.covariance @ whole.rate)
    assert found[0] == pytest.approx(whole.rate @ truth.state, abs=bound * sd)
    assert math.sqrt(found[1]) == pytest.approx(sd, rel=bound)
    assert found[2:] @ small.rate == pytest.approx(found[0], rel=1e-6)
    assert len(found) == 2 + whole.size
    assert found[2:] == pytest.approx(truth.state, abs=bound * math.sqrt(np.diag(truth.covariance).max()))


FAST = ["-O3 -ffast-math", "-Ofast", "-O2 -ffinite-math-only"]


def disturbed(rng: np.random.Generator, missing: float) -> NDArray[np.float64]:
    """Samples of a bias, missing in stretches and one by one, with the last half at rest."""
    y = 1e-3 + 4e-4 * rng.standard_normal(2000)
    y[:3] = y[100:200] = missing
    y[rng.integers(200, 1000, 50)] = missing
    return y


@pytest.mark.long
@pytest.mark.skipif(not (shutil.which("g++") and shutil.which("make")), reason="needs g++ and make")
@pytest.mark.parametrize("optimise", FAST)
@pytest.mark.parametrize(("scalar", "bound"), [("double", 1e-9), ("float", 5e-3)])
@pytest.mark.parametrize("missing", [np.nan, -np.nan, np.inf, -np.inf])
def test_a_missing_sample_is_missing_to_a_compiler_that_is_told_there_is_no_nan(
    optimise: str, scalar: str, bound: float, missing: float, rng: np.random.Generator
) -> None:
    text, y = exported(scalar=scalar), disturbed(rng, missing)
    plain, fast = replayed(text, y, 10), replayed(text, y, 10, optimise=optimise)
    assert np.isfinite(fast[:, 0]).all()
    assert np.abs((fast[:, 0] - plain[:, 0]) / np.sqrt(plain[:, 1])).max() < bound
    assert fast[:, 1] == pytest.approx(plain[:, 1], rel=bound)


@pytest.mark.skipif(not (shutil.which("g++") and shutil.which("make")), reason="needs g++ and make")
@pytest.mark.parametrize("optimise", ["-O1", pytest.param("-Ofast", marks=pytest.mark.long)])
@pytest.mark.parametrize("spike", [6.0, *(pytest.param(x, marks=pytest.mark.long) for x in (1e30, -1.0))])
def test_gate_leaves_out_a_spike_as_if_it_were_missing_and_nothing_else(
    spike: float, optimise: str, rng: np.random.Generator
) -> None:
    """With the gate: what the Python filter makes of the record without the spikes. 6.0 is in standard deviations."""
    text = exported(scalar="double")
    space, c = space_of(text), constants(text)
    y = disturbed(rng, np.nan)
    spikes = np.array([250, 251, 700, 1999])
    without = y.copy()
    without[spikes] = np.nan
    y[spikes] = spike
    if spike == 6.0:  # of the innovation that it is: predicted from what came before
        start = space.transition @ (c["start_gain"] * y[3])
        later = StateSpace(
            transition=space.transition, process=space.process, output=space.output, noise=space.noise,
            rate=space.rate, labels=space.labels, diffuse=space.diffuse,
            initial=space.transition @ space.initial @ space.transition.T + space.process,
        )  # fmt: skip
        run = run_filter(without[4:], later, readout=[space.output], state=start)
        sd = np.sqrt(run.readout_sd[:, 0] ** 2 + space.noise)
        y[spikes] = run.readout[spikes - 4, 0] + 6.0 * sd[spikes - 4]
    expected, ungated = replayed(text, without, 1), replayed(text, y, 1)
    gated = replayed(text, y, 1, gate=5.9, optimise=optimise)
    assert gated[3:] == pytest.approx(expected[3:], rel=1e-7, abs=1e-15)
    assert np.abs(ungated[250, 0] - expected[250, 0]) > np.abs(gated[250, 0] - expected[250, 0])
    assert replayed(text, y, 1, gate=6.1)[-1, 0] == pytest.approx(
        ungated[-1, 0] if spike == 6.0 else expected[-1, 0], rel=1e-7
    )


@pytest.mark.skipif(not shutil.which("g++"), reason="needs g++")
def test_three_axes_live_in_one_program(tmp_path: Path) -> None:
    """Each in its namespace, with and without a steady gain, under all warnings, in a folder with nothing else."""
    parts = [
        exported(GYRO, namespace="gyro_x", horizon=60.0),
        exported(NoiseModel.of(White(N=1e-4)), namespace="gyro_y"),
        exported(
            GYRO, namespace="gyro_z", horizon=60.0, scalar="double", flicker="single", correlation_time=9.0
        ),
    ]
    for number, text in enumerate(parts):
        (tmp_path / f"m{number}.hpp").write_text(text, encoding="utf-8")
    (tmp_path / "all.cpp").write_text(
        '#include "m0.hpp"\n#include "m1.hpp"\n#include "m2.hpp"\n'
        "gyro_x::BiasFilter x; gyro_y::BiasFilter y; gyro_z::FixedGainFilter z;\n"
        "void start() { begin(x); begin(y); begin(z, 0.0); }\n"
        "double step(float a) { on_sample(x, a); on_sample(y, a); on_sample(z, double(a));\n"
        "  return double(bias(x) + bias(y)) + bias(z) + double(bias_variance(x)); }\n",
        encoding="utf-8",
    )
    strict = ["-std=c++17", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wdouble-promotion", "-Werror"]
    plain = ["-fno-exceptions", "-fno-rtti", "-fsyntax-only"]
    done = subprocess.run(
        ["g++", *strict, *plain, "all.cpp"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(not shutil.which("g++"), reason="needs g++")
def test_headers_compile_from_the_folder_that_the_command_names(tmp_path: Path, run: Run) -> None:
    """Each by itself, with nothing else on the include path."""
    folder = Path(run("include-path").out.strip())
    headers = sorted((folder / "allanite").glob("*.hpp"))
    assert len(headers) == len(list((ROOT / "kernels" / "include" / "allanite").glob("*.hpp")))
    for name in ("kalman.hpp", "online_allan.hpp"):
        source = tmp_path / "main.cpp"
        source.write_text(f"#include <allanite/{name}>\nint main() {{}}\n", encoding="utf-8")
        command = ["g++", "-std=c++17", "-Wall", "-Werror", "-fsyntax-only", f"-I{folder}", source]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


#: What firmware may run holds with -ffast-math.
FAST_HEADERS = {
    *("allan", "biweight", "bits", "diffuse", "few_states", "kalman", "lagged", "noise", "online_allan"),
    *("pairs_in_runs", "phase", "slice", "square_root", "theo", "window_pairs"),
}


@pytest.mark.long
@pytest.mark.skipif(not shutil.which("g++"), reason="needs g++")
def test_a_header_holds_with_fast_math_or_refuses_it(tmp_path: Path) -> None:
    """What holds is run with it by kernels/tests/kernels_test.cpp and the filters above."""
    held = set()
    for header in sorted((ROOT / "kernels" / "include" / "allanite").glob("*.hpp")):
        source = tmp_path / "main.cpp"
        source.write_text(f"#include <allanite/{header.name}>\nint main() {{}}\n", encoding="utf-8")
        command = ["g++", "-std=c++17", "-ffast-math", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
        done = subprocess.run(
            [*command, f"-I{header.parents[1]}", source], capture_output=True, text=True, check=False
        )
        if done.returncode == 0:
            held.add(header.stem)
        else:
            assert "without -ffast-math" in done.stderr, header.name
    assert held == FAST_HEADERS


@pytest.mark.skipif(
    not (shutil.which("arm-none-eabi-g++") and shutil.which("make")),
    reason="needs arm-none-eabi-g++ and make",
)
def test_example_fits_a_cortex_m4(tmp_path: Path) -> None:
    """No heap, no exceptions, no software double (the makefile looks), and some kilobytes."""
    printed = make("cortex-m4", tmp_path)
    full, fixed = ([int(x) for x in line.split()[:3]] for line in printed.splitlines()[-2:])
    assert full[0] < 6 << 10
    assert full[1] + full[2] < 4 << 10
    assert fixed[0] < 1 << 10
    assert fixed[1] + fixed[2] < 64
    # the sizes that the documents state
    for page in ("firmware/README.md", "docs/howto/firmware.md"):
        stated = (ROOT / page).read_text(encoding="utf-8")
        assert f"{full[0] / 1000:.1f} kB" in stated, page
        assert f"{full[2] / 1000:.1f} kB" in stated, page
