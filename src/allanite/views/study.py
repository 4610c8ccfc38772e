# SPDX-License-Identifier: BSD-3-Clause
"""What a study says: the coefficients of every channel, its curve, findings, and how much longer to record."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from allanite.noise import NoiseModel
from allanite.plain_files.counted import plural
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, number, probability
from allanite.recording.health.catalogue.samples import BY_SAMPLES
from allanite.recording.health.finding import Finding
from allanite.stability.environment.results import EnvironmentFacts
from allanite.study.results import ChannelModels, ChannelStudy, StudiedRecord
from allanite.study.study import Study
from allanite.views.blocks import (
    Banner,
    Cards,
    Cell,
    Coefficients,
    Details,
    Findings,
    KeyNumbers,
    Page,
    PageBlock,
    References,
    Subheading,
    Text,
    drawn,
    equation,
    pairs,
    table,
)
from allanite.views.environment import (
    coefficient_table,
    effect_table,
    environment_picture,
    environment_sentences,
    known_facts,
)
from allanite.views.figures.curves import STATISTICS
from allanite.views.pieces import finding_row
from allanite.views.result_page import advice, result_page
from allanite.views.spectrum import LINE_HEADS, line_rows
from allanite.views.wording.findings import findings_headline, worst
from allanite.views.wording.floor import floor_lines
from allanite.views.wording.provisos import provisos
from allanite.views.wording.rates import capitalised, sentence
from allanite.views.wording.recorded import missing_lines, record_facts
from allanite.views.wording.study import (
    EQUIVALENT,
    GUARANTEE,
    ChannelGroup,
    CoefficientWording,
    cautions,
    groups,
    is_poor,
    key_numbers,
    limit_words,
    reading,
    readings,
    shown_symbol,
    slope_reading,
)

__all__ = ["parameter_blocks", "view"]

_IEEE = "B is the IEEE 952 coefficient: the floor of the curve divided by 0.664."
_SLOPES = (
    "Only for comparison with older work: if terms overlap, slope readings are biased (T_b by up to 77 %, "
    "K by 15 % and more), and they have no interval."
)
_FEW = "few windows: the curve is low on average, by a fifth with one window; its band remains valid"
_FLOOR = (
    " The model is that of the sensor without its instrument, whose curve is gray; diamonds: the "
    "difference of the two variances; a bar alone is its upper limit."
)
_LINES = (
    "Lines, with 95 % intervals. Chance: the probability of such a peak from noise alone, anywhere in the "
    "record. A steady line is removed before the fit, and is a sinusoid of the model."
)
_OF_SAMPLES = (
    "The coefficients maximize the Gaussian likelihood of all samples, with the exact covariances of "
    "block means on several levels and of slow contrasts of the whole record; no coefficient is negative."
)
_OF_CURVE = (
    "The coefficients minimize (v − v(p))ᵀ V⁻¹ (v − v(p)), where V is the exact finite-sample covariance of the curve "
    "v under the model, iterated, and no coefficient is negative."
)
_SETS = (
    "Each 95 % interval is the set of values that a test in the full family of terms does not reject; a "
    "term is supported if its set excludes zero; otherwise the upper end of the set is its limit. Flicker "
    "and Gauss-Markov are alternative families; if the record cannot decide, both are given. Bands around "
    "the curve are "
    "chi-square intervals."
)
_IEEE_952 = (
    "IEEE Std 952-1997, “Specification format guide and test procedure for single-axis interferometric fiber optic "
    "gyros”, annex C."
)
_SILVA = (
    "F. O. Silva, R. R. Jeronymo, F. A. Pavan, R. T. Tosin, “Caracterização de sensores MEMS através da variância de "
    "Allan para a filtragem de ruídos estocásticos”: the reading by slopes."
)
_REFERENCES = (
    _IEEE_952,
    "D. W. Allan, “Statistics of atomic frequency standards”, Proceedings of the IEEE 54 (1966) 221.",
    "C. A. Greenhall, W. J. Riley, “Uncertainty of stability variances based on finite differences”, PTTI 2003.",
    "W. J. Riley, “Handbook of frequency stability analysis”, NIST Special Publication 1065 (2008).",
    "N. F. Zhang, “Allan variance of time series models for measurement data”, Metrologia 45 (2008) 549.",
    _SILVA,
)
_ORDER = ("N", "B", "B_equiv", "T", "sigma", "q", "K", "R", "Q")
_NAMES = {
    "B_equiv": "B with the same peak",
    "sigma": "Gauss-Markov deviation",
    "q": "Gauss-Markov driving noise",
}


def view(study: Study) -> Page:
    """The page of a study."""
    sections: dict[str, tuple[str, Sequence[PageBlock]]] = {
        "verdict": ("Verdict", [*_verdict(study)]),
        "curves": ("Curves", [*_curves(study)]),
        "environment": ("Environment", [*_environment(study)]),
        "findings": ("Findings", [*_findings(study)]),
        "longer": ("How much longer to record", [*_longer(study)]),
        "record": ("Record", [*_record(study)]),
        "spectra": ("Spectra", [*_spectra(study)]),
        "method": ("Method", [*_method(study)]),
    }
    return result_page(
        study,
        title=study.provenance.source or "recording",
        kicker="Noise characterization",
        facts=_facts(study.recording),
        sections=sections,
    )


def _facts(record: StudiedRecord) -> list[tuple[str, str]]:
    missing = f"{100 * record.missing / record.samples:.2g} %" if record.missing else "none"
    return [
        ("Channels", str(len(record.channels))),
        ("Length", duration(record.duration)),
        ("Rate", f"{record.rate:.7g} Hz"),
        ("Samples", f"{record.samples:,}".replace(",", "\u202f")),
        ("Missing", missing),
        ("Start", (record.start or "").replace("T", " ").replace("Z", " UTC")),
    ]


# -- the verdict -------------------------------------------------------------------------------------------


def _verdict(study: Study) -> Iterator[PageBlock]:
    record = study.recording
    tone, words = findings_headline(study.findings)
    about = f"{plural(len(record.channels), 'channel')}, {duration(record.duration)} at {record.rate:.7g} Hz."
    yield Banner(tone, words, about)
    for finding in (f for f in study.findings if f.accepted):
        row = finding_row(finding, record.rate)
        risk = f" The risk: {row.risk}." if row.risk else ""
        yield Banner(
            "fatal", f"Accepted despite “{row.code}”", f"({row.channel}): {row.message}.{risk}", brief=False
        )
    gravest = worst(f for f in study.findings if not f.accepted)
    if gravest is not None:
        yield _worst(gravest, record.rate)
    for words in environment_sentences(c.environment for c in study.channels):
        yield Banner("warning", "Environment:", words)
    yield from parameter_blocks(study.channels)


def _worst(finding: Finding, rate: float) -> PageBlock:
    row = finding_row(finding, rate)
    words = f"({row.channel}): {row.message}. {capitalised(row.advice)}."
    return Banner(row.severity, f"Worst finding: {row.code}", words, brief=False)


def parameter_blocks(channels: Sequence[ChannelModels]) -> Iterator[PageBlock]:
    """The coefficients of channels in tables, and what a reader of them must know."""
    names = [c.name for c in channels]
    tables = [Coefficients(group) for group in groups(channels)]
    for coefficients in tables:
        yield from _group_blocks(coefficients)
    yield from advice([*cautions(channels), *provisos(channels)], names)
    if not any(coefficients.heads for coefficients in tables):
        return
    read_off = {m.verdict for c in channels for m in c.models if m.family == "slopes"}
    yield Text("\n".join(read_off) or GUARANTEE, note=True, brief=True)
    if any("B" in coefficients.heads for coefficients in tables):
        yield Text(_IEEE, note=True, detail=True)


def _group_blocks(coefficients: Coefficients) -> Iterator[PageBlock]:
    """What channels of one kind answer, and the table of it with the footnote of its stars."""
    group = coefficients.group
    yield Subheading(group.title)
    if numbers := key_numbers(group):
        yield KeyNumbers(numbers)
    if words := limit_words(group):
        yield Text(words)
    if not coefficients.heads:
        return
    yield coefficients
    if any(r.equivalent for c in group.channels for r in readings(c).values()):
        yield Text(EQUIVALENT, note=True, brief=True)
    if group.has_si:
        yield Details("The same in SI", [Coefficients(group, si=True)])


# -- one channel after another -----------------------------------------------------------------------------


def _curves(study: Study) -> Iterator[PageBlock]:
    for i, group in enumerate(groups(study.channels)):
        names = [c.name for c in group.channels]
        curve = group.channels[0].curve
        statistic = STATISTICS[curve.statistic]
        if len(names) > 1:
            yield from drawn(
                f"group-{i}",
                study,
                f"{group.title}: {statistic} of all channels with {100 * curve.confidence:g} % bands and "
                "models; thin lines show the slopes of the terms. Each channel follows below with its "
                "terms and limits.",
                f"{statistic} against averaging time of {', '.join(names)}.",
                view="groups",
                channels=names,
            )
        for j, channel in enumerate(group.channels):
            figure = [*_channel_figure(f"channel-{i}-{j}", channel)]
            more = Cards([*(_model(m, channel, group) for m in channel.models), *_beside(channel)])
            if len(names) > 1:
                yield Details(f"{channel.name}: terms and limits, fit, slopes", [*figure, more])
            else:
                yield from figure
                yield Details("Terms and limits, fit, slopes", [more])


def _channel_figure(id_: str, channel: ChannelStudy) -> Iterator[PageBlock]:
    summary = "; ".join(f"{shown_symbol(s)} {r.text}" for s, r in readings(channel).items()) or "no model"
    yield from drawn(
        id_,
        channel,
        f"{channel.name}: measured curve with band, fitted model (dashed), its terms (thin) with their reading points, "
        "and upper limits (dotted, with arrows)."
        + (" Hollow points are not in the fit." if _left_out(channel) else "")
        + (_FLOOR if channel.floor else ""),
        f"{STATISTICS[channel.curve.statistic]} of {channel.name}: {summary}",
    )


def _left_out(channel: ChannelStudy) -> int:
    """Lags that have a deviation and are not in the fit."""
    curve = channel.curve
    if channel.of_samples or not curve.used.size:
        return 0
    return int((np.isfinite(curve.deviation) & ~curve.used).sum())


def _model(
    model: NoiseModel, channel: ChannelStudy, group: ChannelGroup[ChannelStudy]
) -> tuple[str, list[PageBlock]]:
    family = model.family.title() if model.family else "Model"
    undecided = " (undecided)" if len(channel.models) > 1 else ""
    heads = ("Symbol", "Estimate", "95 % interval")
    estimates = sorted(model.estimates, key=lambda e: _order(e.symbol))
    rows = [
        _estimate_row(_symbol_name(e.symbol, group), reading(channel.kind, channel.unit, e), group.has_si)
        for e in estimates
    ]
    return f"{family} family{undecided}", [
        *([Text(model.verdict)] if model.verdict else []),
        *table(heads, rows),
        *_goodness(model),
        *_correlations(model),
    ]


def _estimate_row(name: str, read: CoefficientWording, has_si: bool) -> list[Cell]:
    bounded = read.value != "not bounded"
    si = f"{read.si} {read.si_unit}" if bounded and has_si and read.si_unit != read.unit else ""
    below = "; ".join(part for part in (si, read.note) if part)
    value = f"{read.value} {read.unit}" if bounded else read.value
    return [
        Cell(text=_symbol(read.symbol), below=name),
        Cell(text=value, below=below, look="value" if read.supported else "limit"),
        Cell(text=read.range or ("upper limit" if bounded else "–")),
    ]


def _symbol(symbol: str) -> str:
    return shown_symbol(symbol).replace("sigma", "σ")


def _order(symbol: str) -> int:
    base = symbol.removesuffix("_2")
    return 2 * (_ORDER.index(base) if base in _ORDER else len(_ORDER)) + (base != symbol)


def _symbol_name(symbol: str, group: ChannelGroup[ChannelStudy]) -> str:
    base = symbol.removesuffix("_2")
    second = ", number 2" if base != symbol else ""
    return _NAMES[base] + second if base in _NAMES else group.name_of(symbol)


def _goodness(model: NoiseModel) -> Iterator[PageBlock]:
    chi2 = model.goodness.get("chi2")
    if chi2 is None or math.isnan(chi2):
        return
    chance = probability(model.goodness.get("p"))
    words = f"χ² = {number(chi2)} with {model.goodness['dof']:g} degrees of freedom, {chance}."
    if is_poor(model):
        yield Banner("warning", "The model does not explain the curve:", words)
    else:
        yield Text(f"Goodness of fit: {words}", note=True)


def _correlations(model: NoiseModel) -> Iterator[PageBlock]:
    """Correlation of the estimates; a single parameter has none."""
    symbols = model.covariance.get("symbols", ())
    if len(symbols) < 2:
        return
    matrix = np.array(model.covariance["matrix"], dtype=np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        sds = np.sqrt(np.diag(matrix))
        correlation = matrix / np.outer(sds, sds)
    shown = [[f"{r:+.2f}".replace("-", "−") if math.isfinite(r) else "–" for r in row] for row in correlation]
    names = [_symbol(s) for s in symbols]
    rows = [[name, *cells] for name, cells in zip(names, shown, strict=True)]
    yield Details("Correlation of the estimates", table(("", *names), rows))


def _beside(channel: ChannelStudy) -> Iterator[tuple[str, list[PageBlock]]]:
    unit, factor = display_unit(channel.kind, "mean", channel.unit)
    spread, spread_factor = display_unit(channel.kind, "sd", channel.unit)
    lags, left_out = int(np.isfinite(channel.curve.deviation).sum()), _left_out(channel)
    basis = _basis_words(channel.curve.interval_basis)
    facts = [
        ("Mean", f"{number(_or_zero(channel.mean) / factor, 5)} {unit}"),
        ("Standard deviation", f"{number(_or_zero(channel.sd) / spread_factor, 4)} {spread}"),
        ("Lags", f"{lags}" + (f", {left_out} of them not in the fit" if left_out else "")),
        ("Bands assume", basis),
        ("Longest lags", _FEW if basis else ""),
    ]
    apart: list[PageBlock] = []
    if channel.floor is not None:
        parts = (channel.curve, channel.floor.curve, channel.floor.sensor)
        apart = [
            Details("Instrument and sensor apart", table(*floor_lines(channel.kind, channel.unit, *parts)))
        ]
    yield "Beside the model", [pairs(facts, brief=False), *apart]
    read = {r.symbol: r for r in channel.slopes}
    if read:
        rows = [
            (shown_symbol(s), slope_reading(channel, read[s]))
            for s in ("N", "B", "T", "K", "R", "Q")
            if s in read
        ]
        yield "Read off the curve by slope", [pairs(rows, brief=False), Text(_SLOPES, note=True)]
    elif channel.no_slopes:
        yield "Read off the curve by slope", [Text(channel.no_slopes, note=True)]


def _basis_words(basis: str) -> str:
    """What the bands rest on; a model is written in the tables, in the units of the sensor."""
    return "exact under the fitted model" if "NoiseModel(" in basis else basis


def _or_zero(value: float) -> float:
    return 0.0 if math.isnan(value) else value


# -- the rest ----------------------------------------------------------------------------------------------


def _environment(study: Study) -> Iterator[PageBlock]:
    estimates = [c.environment for c in study.channels if c.environment is not None]
    if estimates:
        yield Text(
            "Curves and noise models above are those of the residual, corrected for the noise that the "
            "regression removed."
        )
    for estimate in estimates:
        yield from _environment_of(estimate)


def _environment_of(estimate: EnvironmentFacts) -> Iterator[PageBlock]:
    yield Subheading(estimate.channel)
    yield from coefficient_table(estimate, brief=False)
    yield from environment_picture(estimate)
    yield from effect_table(estimate, brief=False)
    yield known_facts(estimate, brief=False)


def _findings(study: Study) -> Iterator[PageBlock]:
    if study.findings:
        yield Findings(study.findings, study.recording.rate, first=True)


def _longer(study: Study) -> Iterator[PageBlock]:
    every = [(channel, each) for channel in study.channels for each in channel.advice]
    asked = [(channel, each) for channel, each in every if not each.reached]
    finite = [(each.duration, c.name, each.text) for c, each in asked if math.isfinite(each.duration)]
    if any(f.advice == BY_SAMPLES for f in study.findings):
        yield Text(sentence(f"Next: gaps cut the curve short; {BY_SAMPLES}"), brief=True)
    elif finite:
        _, name, text = min(finite)
        yield Text(sentence(f"Next: {name}: {text}"), brief=True)
    rows = [
        (
            channel.name,
            shown_symbol(each.symbol),
            duration(each.duration) if math.isfinite(each.duration) else "–",
            each.text,
        )
        for channel, each in asked
    ]
    if len(rows) > len(finite[:1]):  # the only one is stated already
        listed = table(("Channel", "Term", "Whole record", "Benefit"), rows, brief=False)
        yield Details("Every channel and term", listed)
    if not rows:
        yield Text("Nothing to advise.")
    reached: dict[str, list[str]] = {}
    for channel, each in every:
        if each.reached:
            reached.setdefault(each.text, []).append(channel.name)
    yield from (Text(f"{capitalised(text)}: {', '.join(names)}.") for text, names in reached.items())
    yield Text(
        "Total length of the record at the same rate, computed from the fitted model and the covariance "
        "of the curve.",
        note=True,
    )


def _record(study: Study) -> Iterator[PageBlock]:
    record, gaps = study.recording, _gaps(study.recording)
    yield Text(gaps)
    yield from table(
        ("Reason", "Gaps", "Samples", "Longest", "First at"),
        missing_lines(record.missing_because, record.rate),
        caption="Missing samples and their reasons, as noted by the recorder.",
        brief=False,
    )
    yield pairs(record_facts(record.history), verbatim=True, brief=False)
    names = [c.name for c in study.channels if c.overview.t.size]
    if names:
        yield from drawn(
            "overview",
            study,
            "The record: minimum and maximum of each block. Gray: no samples. Amber, at the bottom: a "
            "location of a finding.",
            f"Overview of all channels against time. {gaps}",
            view="record",
            channels=names,
        )


def _gaps(record: StudiedRecord) -> str:
    if not record.gaps:
        return "No sample is missing."
    longest = max((b - a) / record.rate for a, b in record.gaps)
    count = len(record.gaps)
    if count == 1:
        return f"{plural(record.missing, 'sample')} missing in one gap of {duration(longest)} (shaded)."
    gaps = f"{'at least ' if count >= 100 else ''}{count} gaps, the longest of {duration(longest)} (shaded)"
    return f"{record.missing} samples missing in {gaps}."


def _spectra(study: Study) -> Iterator[PageBlock]:
    kinds = groups(study.channels)
    for i, group in enumerate(kinds):
        names = [c.name for c in group.channels]
        fitted = "samples" if any(c.of_samples for c in group.channels) else "curve"
        figure = drawn(
            f"spectrum-{i}",
            study,
            f"{group.title}: root of the two-sided power spectral density; dashed, the model fitted to the {fitted}, "
            "as these segments would show it. Where they disagree, the record contains something other than noise.",
            f"Spectrum of {', '.join(names)} with the model.",
            view="spectrum",
            channels=names,
        )
        yield from (
            [Details(f"{group.title}: spectrum and model", figure)] if figure and len(kinds) > 1 else figure
        )
        rows = [row for c in group.channels for row in line_rows(c.name, c.kind, c.unit, c.spectrum.lines)]
        yield from table(LINE_HEADS, rows, caption=_LINES, brief=False)


def _method(study: Study) -> Iterator[PageBlock]:
    shown = sorted({_in_a_sentence(STATISTICS[c.curve.statistic]) for c in study.channels})
    yield Text(
        f"The curve is the {' and the '.join(shown)} over averaging times τ = m Tₛ. Its square is "
        "computed from the running sum θ of the samples over all complete overlapping windows; gaps are "
        "neither closed up nor filled:"
    )
    yield from equation("allan_variance")
    yield Text(
        "The model is a sum of independent terms, in the letters of IEEE Std 952; S is the two-sided power spectral "
        "density."
    )
    yield from equation("noise_terms")
    yield Text(f"{_OF_SAMPLES if any(c.of_samples for c in study.channels) else _OF_CURVE} {_SETS}")
    yield References(_REFERENCES)


def _in_a_sentence(name: str) -> str:
    proper = name.startswith(("Allan", "Hadamard", "Haar", "Theo1", "ThêoH"))
    return name if proper else name[0].lower() + name[1:]
