# SPDX-License-Identifier: BSD-3-Clause
"""Figures of every result: `plot` states what is shown; thin renderers draw it, on paper and on screen alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, overload

from allanite.errors import InputError
from allanite.plain_files.extras import require
from allanite.quantities.result import Result
from allanite.views.figures.panel import Panel, Sheet
from allanite.views.registry import VIEWS, kind_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure as PaperFigure

    from allanite.experiments.aided_readings import AidedTake
    from allanite.experiments.alignment import AlignmentEstimate
    from allanite.experiments.calibration import CalibrationEstimate
    from allanite.experiments.dead_reckoning import DeadReckoning
    from allanite.experiments.north import NorthEstimate
    from allanite.experiments.position_planning import PositionPlan
    from allanite.experiments.rate_table import RateTableEstimate
    from allanite.experiments.redundancy import Combination
    from allanite.filtering.kalman import FilterEstimate
    from allanite.fitting.model_difference import Difference
    from allanite.fitting.selection import TermSelection
    from allanite.fitting.spectral.spectra import Spectra
    from allanite.stability.fleet.charts import ControlChart
    from allanite.stability.fleet.results import FleetPopulation
    from allanite.stability.record_comparison.results import Comparison
    from allanite.stability.variation import Variation
    from allanite.study.datasheet import DatasheetJudgement
    from allanite.study.results import ChannelStudy
    from allanite.study.study import Study
    from allanite.views.figures.screen import ScreenFigure
    from allanite.views.wording.study import ChannelGroup

__all__ = ["plot", "sheet_of"]

Json = Mapping[str, Any]
Parts = dict[str, Callable[[], Sequence[Panel]]]


@overload
def plot(
    obj: object, *, interactive: Literal[False] = False, dark: bool = False, ax: Any = None, **options: Any
) -> PaperFigure: ...
@overload
def plot(obj: object, *, interactive: Literal[True], dark: bool = False, **options: Any) -> ScreenFigure: ...
def plot(
    obj: object, *, interactive: bool = False, dark: bool = False, ax: Any = None, **options: Any
) -> PaperFigure | ScreenFigure:
    """Draw any result.

    Parameters
    ----------
    obj : object
        Study, AllanCurve, NoiseModel, Recording, Spectrum, one of a study's channels, Reversals,
        EarthRateEstimate, RateVector, NorthEstimate, AlignmentEstimate, CalibrationEstimate, Filtered,
        ReferenceAided, Plan (or a list of plans), or a `Sheet` of your own. The document of a result (`to_json`) does
        as well.
    interactive : bool
        False: a Matplotlib figure, for ``savefig("curve.pdf")``. True: a figure to zoom and read in a browser or a
        notebook, which needs no network; ``save("curve.html")`` writes it.
    dark : bool
        Light ink on a dark ground.
    ax : Axes or sequence of Axes, optional
        Axes of Matplotlib to draw into, one for each panel, in place of a new figure.
    **options
        Study: `view` ("channels": each channel with its terms; "groups": all axes of a kind together; "spectrum";
        "record") and `channels`, names of those wanted. Channel entry: `view`. AllanCurve: `model`, a NoiseModel to
        draw over it. NoiseModel: `tau`, the two ends [s]. Spectrum: `kind` of its channel, `model` to draw over it,
        and `view` ("whole", "density", "ratio").
        Recording: `channels`; `turns`, a result that holds turns, to mark them. Reversals: `recording`, and `zoom`,
        the number of a turn to look at closely. EarthRateEstimate: `view` ("whole", "record", "running", "dwells",
        "residuals", "dead-time", "estimators", "bias") and `recording`, which its record needs. RateVector: `view`
        ("whole", "length", "means", "record") and `recording`, which the record needs. Filtered: `view`
        ("whole", "series", "drift", "terms", "whiteness"). NorthEstimate: `view` ("whole", "compass", "running").
        AlignmentEstimate: `view` ("whole", "compass", "convergence", "residuals").
        CalibrationEstimate: `view` ("whole", "sphere", "residuals", "parameters", "correlation", "log") and
        `recording`, which the log needs.
        DatasheetJudgement: `view` ("whole", "curves", "ratio"). Bounds: `view` ("whole", "curves", "inflation").
        InMotion: `view` ("whole", "inflation", "spectra"). Innovations: `view` ("whole", "nis", "bands").
        Difference: `view` ("whole", "curves", "drift"). Selection: `view` ("whole", "weights", "curves") and
        `channels`. Separation: `view` ("whole", "parts", "correlation"). Variation: `view` ("whole", "map", "lines")
        and `channels`. Combination: `view` ("whole", "parity", "deviation", "gain"). Comparison: `view` ("whole",
        "curves", "parameters"). FleetPopulation: `view` ("whole", "population", "lots"). ControlChart: `view` ("whole",
        "individuals", "ewma"). EnvironmentEstimate: `view` ("whole", "temperature", "deviation", "time").
        DeadReckoning: `view` ("whole", "position", "height", "velocity", "tilt", "heading"). PositionPlan: `view`
        ("whole", "sphere", "length", "schemes"). StaticSpans: `view` ("whole", "level", "record") and `recording`,
        which the record needs.

    Returns
    -------
    matplotlib.figure.Figure or ScreenFigure

    Raises
    ------
    InputError
        Nothing that has a figure, an unknown option or channel, another number of axes than panels; no Matplotlib.

    Examples
    --------
    >>> import allanite as al
    >>> from allanite.noise import RandomWalk, White
    >>> figure = al.plot(al.NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-6)))
    >>> figure.savefig("model.pdf")  # doctest: +SKIP
    """
    sheet = sheet_of(obj, **options)
    if interactive:
        if ax is not None:
            raise InputError("ax= draws into axes of Matplotlib: leave out interactive=True")
        from allanite.views.figures.screen import ScreenFigure

        return ScreenFigure(sheet, dark=dark)
    require("matplotlib", "plot", "a figure of Matplotlib", ", or draw it with interactive=True")
    from allanite.views.figures.matplotlib import figure, figure_with

    return figure(sheet, dark=dark) if ax is None else figure_with(ax, sheet, dark=dark)


def sheet_of(obj: object, **options: Any) -> Sheet:
    """What `plot` would draw, without a plotting library."""
    shown = _result_of(obj)
    for matches, describe in _DESCRIPTIONS:
        if matches(shown):
            try:
                return describe(shown, **options)
            except TypeError as error:
                if "unexpected keyword" not in str(error):
                    raise
                raise InputError(f"{error}: not an option of the figure of a {type(obj).__name__}") from None
    raise InputError(
        f"no figure for a {type(obj).__name__}: pass a recording, a curve, a model, a study or another result of "
        "allanite, or its document"
    )


def _result_of(obj: object) -> object:
    """The result of a document, or of what holds more than its document; anything else as it is."""
    if not isinstance(obj, Mapping):
        held = getattr(obj, "result", obj)
        return held if isinstance(held, Result) else obj
    drawn_from_document = obj.get("format") not in VIEWS or obj["format"] in _WITH_THEIR_RECORD
    return obj if drawn_from_document else kind_of(obj).from_json(obj)


# -- one function per thing that has a figure --------------------------------------------------------------


def _study(shown: Study, *, view: str = "channels", channels: Sequence[str] | None = None) -> Sheet:
    from allanite.views.wording.study import groups

    names = [channels] if isinstance(channels, str) else channels
    chosen = shown.channels if names is None else [shown[name] for name in names]
    return Sheet(rows=tuple(row for group in groups(chosen) for row in _view(view)(group, shown)))


def _channel(channel: ChannelStudy | Json, *, view: str = "channels") -> Sheet:
    from allanite.study.results import ChannelStudy
    from allanite.study.version_1 import upgraded_channel
    from allanite.views.wording.study import groups

    if isinstance(channel, Mapping):
        channel = ChannelStudy.from_json(upgraded_channel(channel))
    return Sheet(rows=tuple(_view(view)(groups([channel])[0], None)))


def _view(name: str) -> Callable[[ChannelGroup[ChannelStudy], Study | None], list[tuple[Panel, ...]]]:
    from allanite.views.figures import curves, records, spectra

    views: dict[str, Callable[[ChannelGroup[ChannelStudy], Study | None], list[tuple[Panel, ...]]]] = {
        "channels": lambda group, _: _rows_of(curves.channel_panels(group)),
        "groups": lambda group, _: [(curves.group_panel(group),)],
        "spectrum": lambda group, _: [(spectra.group_spectrum_panel(group),)],
        "record": lambda group, study: [(p,) for p in records.group_record_panels(group, study)],
    }
    if name not in views:
        raise InputError(f"no view {name!r} of a study; there are: {', '.join(views)}")
    return views[name]


def _rows_of(panels: Sequence[Panel], most: int = 3) -> list[tuple[Panel, ...]]:
    return [tuple(panels[i : i + most]) for i in range(0, len(panels), most)]


def _curve(curve: Any, *, model: Any = None) -> Sheet:
    from allanite.views.figures.curves import curve_panels

    return _column(curve_panels(curve, model))


def _over_floor(curve: Any) -> Sheet:
    from allanite.views.figures.curves import over_floor_panels

    return _column(over_floor_panels(curve))


def _model(model: Any, *, tau: tuple[float, float] = (1e-2, 1e5)) -> Sheet:
    from allanite.views.figures.curves import model_panel

    return Sheet(rows=((model_panel(model, tau),),))


def _recording(recording: Any, *, channels: Sequence[str] | None = None, turns: Any = None) -> Sheet:
    if turns is None:
        from allanite.views.figures.records import recording_panels

        return _column(recording_panels(recording, channels))
    from allanite.views.figures.turned import only_rate, turned_panel

    names = (only_rate(recording, None),) if channels is None else channels
    panels = [turned_panel(recording, turns, channel=name) for name in names]
    return _column([replace(p, title=f"{n}: {p.title}") for n, p in zip(names, panels, strict=True)])


def _spectrum(
    spectrum: Any, *, kind: str = "unknown", unit: str = "SI unit", model: Any = None, view: str = "whole"
) -> Sheet:
    from allanite.fitting.spectral.spectra import ChannelSpectrum, Spectra

    kind = kind if model is None else model.kind
    channel = ChannelSpectrum(name=spectrum.channel, kind=kind, unit=unit, spectrum=spectrum, model=model)
    return _spectra(Spectra(channels=(channel,)), view=view)


def _spectra(result: Spectra, *, channel: str | None = None, view: str = "whole") -> Sheet:
    from allanite.views.figures import spectra

    _known_view(view, spectra.VIEWS, "a spectrum")
    panels: list[Panel] = []
    for one in result.channels if channel is None else [result[channel]]:
        if view in ("whole", "density"):
            panels.append(spectra.spectrum_panel(one))
        if view in ("whole", "ratio") and one.expected is not None:
            panels.append(spectra.ratio_panel(one, one.expected))
    if not panels:
        raise InputError("the ratio to a model needs a model")
    return _column(panels)


def _reversals(
    reversals: Any, *, recording: Any = None, channel: str | None = None, zoom: int | None = None
) -> Sheet:
    from allanite.views.figures.turned import turned_panels

    if recording is None:
        raise InputError("turns are drawn over their record: pass recording=, a Recording or its overview")
    return _column(turned_panels(recording, reversals, channel=channel, zoom=zoom))


def _earth_rate(estimate: Any, *, view: str = "whole", recording: Any = None) -> Sheet:
    from allanite.experiments.earth_rate import EarthRateEstimate
    from allanite.experiments.earth_rate.verdict import EarthRateVerdict
    from allanite.views.figures import earth
    from allanite.views.figures.turned import turned_panel

    _known_view(view, earth.VIEWS, "an Earth rate")
    given = isinstance(estimate, Mapping)
    result: EarthRateEstimate = EarthRateEstimate.from_json(estimate) if given else estimate
    overview = estimate.get("overview") if given and recording is None else recording
    turns = result.reversals
    if view == "record":
        return _reversals(turns, recording=overview, channel=result.channel)
    parts: Parts = {
        "record": lambda: [] if overview is None else [turned_panel(overview, turns, channel=result.channel)],
        "bias": lambda: [earth.open_panel(result)],
    }
    if result.verdict is not EarthRateVerdict.NOT_SEPARABLE:
        parts = {
            **parts,
            "running": lambda: [earth.running_panel(result)],
            "dwells": lambda: earth.dwell_panels(result)[:1],
            "residuals": lambda: earth.dwell_panels(result)[1:],
            "dead-time": lambda: [earth.dead_time_panel(result)] if len(result.dead_times) else [],
            "estimators": lambda: [earth.estimator_panel(result)],
        }
        del parts["bias"]
    return _in_view(
        parts, view, f"this record has no figure {view!r}; there are: {', '.join(('whole', *parts))}"
    )


def _filtered(result: FilterEstimate, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import filters

    _known_view(view, filters.VIEWS, "a filtered record")
    parts: Parts = {
        "series": lambda: [*filters.series_panels(result)],
        "drift": lambda: [filters.drift_panel(result)],
        "terms": lambda: [filters.terms_panel(result)],
        "whiteness": lambda: [filters.whiteness_panel(result)],
    }
    if view == "whole" and sum(name != "level" for name in result.terms) < 2:  # the drift is that one term
        del parts["terms"]
    return _in_view(parts, view, f"this filtered record has no figure {view!r}")


def _aided(result: AidedTake) -> Sheet:
    from allanite.views.figures import aided

    first = result.readings[0]
    drawn = [aided.raw_panel(first), aided.corrected_panel(first)]
    drawn += [aided.means_panel([reading]) for reading in result.readings]
    return _column(drawn if first.states is None else [*drawn, aided.states_panel(first)])


def _north(result: NorthEstimate, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import compass

    _known_view(view, compass.VIEWS, "a search for north")
    parts: Parts = {
        "compass": lambda: [compass.compass_panel(result)],
        "running": lambda: compass.running_panels(result),
    }
    return _in_view(parts, view, f"this search for north has no figure {view!r}")


def _rate_vector(result: Any, *, view: str = "whole", recording: Any = None) -> Sheet:
    from allanite.experiments.rate_vector import RateVector
    from allanite.study.result_document import Origin
    from allanite.views.figures import vector

    _known_view(view, vector.VIEWS, "a rate vector")
    given = isinstance(result, Mapping)
    shown: RateVector = RateVector.from_json(result) if given else result
    known = Origin.from_json(result).overviews if given and recording is None else recording
    parts: Parts = {
        "length": lambda: vector.length_panels(shown),
        "means": lambda: vector.mean_panels(shown),
        "record": lambda: vector.record_panels(shown, vector.overviews_of(shown, known)),
    }
    return _in_view(parts, view, "this rate vector has nothing to draw: pass its record with recording=")


def _static(result: Any, *, view: str = "whole", recording: Any = None) -> Sheet:
    from allanite.experiments.static_spans import StaticSpans
    from allanite.views.figures import static

    _known_view(view, static.VIEWS, "static spans")
    spans: StaticSpans = StaticSpans.from_json(result) if isinstance(result, Mapping) else result
    parts: Parts = {
        "level": lambda: static.level_panels(spans),
        "record": lambda: static.record_panels(spans, static.overviews_of(spans, recording)),
    }
    return _in_view(parts, view, "these static spans have nothing to draw: pass their record with recording=")


def _calibration(result: CalibrationEstimate, *, view: str = "whole", recording: Any = None) -> Sheet:
    from allanite.views.figures import calibration

    _known_view(view, calibration.VIEWS, "a calibration")
    parts: dict[str, Callable[[], list[tuple[Panel, ...]]]] = {
        "sphere": lambda: _rows_of(calibration.sphere_panels(result), 1),
        "residuals": lambda: _rows_of(calibration.residual_panels(result), 1),
        "parameters": lambda: calibration.parameter_panels(result),
        "correlation": lambda: _rows_of(calibration.correlation_panels(result), 1),
        "log": lambda: _rows_of(calibration.log_panels(result, recording), 1),
    }
    # All panels of a sheet are of one width: those that stand side by side are a sheet of their own.
    wanted = ("sphere", "residuals") if view == "whole" else (view,)
    rows = [row for name in wanted for row in parts[name]()]
    if not rows:
        raise InputError(f"this calibration has no figure {view!r}")
    return Sheet(rows=tuple(rows))


def _alignment(shown: AlignmentEstimate, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import alignment

    _known_view(view, alignment.VIEWS, "an alignment")
    parts: Parts = {
        "compass": lambda: [alignment.compass_panel(shown)],
        "convergence": lambda: alignment.convergence_panels(shown),
        "residuals": lambda: alignment.residual_panels(shown),
    }
    return _in_view(parts, view, f"this alignment has no figure {view!r}")


def _combination(result: Combination, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import redundancy

    _known_view(view, redundancy.VIEWS, "combined sensors")
    parts = {
        "parity": redundancy.parity_panel,
        "deviation": redundancy.deviation_panel,
        "gain": redundancy.gain_panel,
    }
    return _column([make(result) for name, make in parts.items() if view in ("whole", name)])


def _datasheet(result: DatasheetJudgement, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import datasheet

    _known_view(view, datasheet.VIEWS, "a data sheet")
    parts: Parts = {"curves": lambda: [*datasheet.sheet_panels(result)]}
    if result.channels:
        parts["ratio"] = lambda: [datasheet.ratio_panel(result)]
    return _in_view(parts, view, f"this data sheet alone has no figure {view!r}: nothing was measured")


_NO_FIGURE_OF_FLEET = {
    "density": "its document was made by an earlier version",
    "correlations": "no two coefficients correlate",
    "lots": "it has one lot",
}


def _fleet(result: FleetPopulation, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import fleet

    _known_view(view, fleet.VIEWS, "a fleet")
    parts = {
        "population": fleet.population_panels,
        "density": fleet.density_panels,
        "correlations": fleet.correlation_panels,
        "lots": fleet.lot_panels,
    }
    panels = [panel for name, make in parts.items() if view in ("whole", name) for panel in make(result)]
    if not panels:
        raise InputError(f"this fleet has no figure {view!r}: {_NO_FIGURE_OF_FLEET[view]}")
    return Sheet(rows=tuple(_rows_of(panels, 2)))


def _control_chart(result: ControlChart, *, view: str = "whole") -> Sheet:
    from allanite.stability.fleet.control_rules import ControlRule
    from allanite.views.figures import control_chart

    _known_view(view, control_chart.VIEWS, "a control chart")
    weighted = ControlRule.EWMA in result.rules
    parts: Parts = {
        "individuals": lambda: [control_chart.individuals_panel(result)],
        "ewma": lambda: [control_chart.weighted_panel(result)] if weighted else [],
    }
    return _in_view(parts, view, "this chart has no weighted mean")


def _difference(result: Difference, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import difference

    _known_view(view, difference.VIEWS, "two noise models")
    parts = {"curves": difference.curve_panels, "drift": difference.drift_panels}
    made = [[*make(result)] for name, make in parts.items() if view in ("whole", name)]
    if view == "whole":  # each sensor in a row: its curves, and what they add up to
        return Sheet(rows=tuple(zip(*made, strict=True)))
    return Sheet(rows=tuple(_rows_of(made[0], 2)))


def _environment(result: Any, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import environment

    _known_view(view, environment.VIEWS, "the environment of a sensor")
    every = environment.estimates_of(result)
    parts: Parts = {
        "temperature": lambda: [panel for one in every for panel in environment.branch_panels(one)],
        "deviation": lambda: [panel for one in every for panel in environment.deviation_panels(one)],
        "time": lambda: [panel for one in every for panel in environment.time_panels(one)],
    }
    return _in_view(parts, view, f"nothing was found that a figure {view!r} could show")


def _selection(result: TermSelection, *, view: str = "whole", channels: Sequence[str] | None = None) -> Sheet:
    from allanite.views.figures import selection

    _known_view(view, selection.VIEWS, "a selection of terms")
    parts = {"weights": selection.weights_panel, "curves": selection.curves_panel}
    wanted = [channels] if isinstance(channels, str) else channels
    chosen = result.channels if wanted is None else [result[name] for name in wanted]
    return _column([make(c) for c in chosen for name, make in parts.items() if view in ("whole", name)])


def _variation(result: Variation, *, view: str = "whole", channels: Sequence[str] | None = None) -> Sheet:
    from allanite.views.figures import variation

    _known_view(view, variation.VIEWS, "a variation")
    panels: list[Panel] = []
    for channel in result.channels if channels is None else [result[name] for name in channels]:
        if view in ("whole", "map"):
            panels.append(variation.map_panel(channel, result.duration))
        if view in ("whole", "lines"):
            panels += variation.line_panels(channel, result.duration)
    return _column(panels)


def _rate_table(shown: RateTableEstimate, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import response

    _known_view(view, response.VIEWS, "a run on a rate table")
    parts: Parts = {
        "response": lambda: response.response_panels(shown),
        "steps": lambda: response.step_panels(shown),
        "drift": lambda: response.drift_panels(shown),
        "noise": lambda: response.noise_panels(shown),
        "frequency": lambda: response.frequency_panels(shown),
    }
    return _in_view(parts, view, f"this run on a rate table has no figure {view!r}")


def _position_plan(plan: PositionPlan, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import position_plan

    _known_view(view, position_plan.VIEWS, "a plan of positions")
    parts: Parts = {
        "sphere": lambda: position_plan.sphere_panels(plan),
        "length": lambda: [position_plan.length_panel(plan)],
        "schemes": lambda: [position_plan.scheme_panel(plan)],
    }
    return _in_view(parts, view, f"this plan of positions has no figure {view!r}")


def _dead_reckoning(result: DeadReckoning, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import dead_reckoning

    _known_view(view, ("whole", *dead_reckoning.VIEWS), "a budget of dead reckoning")
    views = [v for v in dead_reckoning.VIEWS if not (v == "height" and result.held)]
    parts: Parts = {v: lambda v=v: [dead_reckoning.growth_panel(result, v)] for v in views}  # type: ignore[misc]
    return _in_view(parts, view, f"this budget of dead reckoning has no figure {view!r}: the height is held")


def _comparison(result: Comparison, *, view: str = "whole") -> Sheet:
    from allanite.views.figures import comparison as panels

    _known_view(view, panels.VIEWS, "compared records")
    if view == "whole":
        return Sheet(rows=tuple(panels.columns(result)))
    rows: list[tuple[Panel, ...]] = []
    for channel in result.channels:
        alone = view == "curves"
        rows += _rows_of(
            [panels.curves_panel(result, channel)] if alone else panels.parameter_panels(result, channel), 2
        )
    return Sheet(rows=tuple(rows))


def _plan(plan: Any) -> Sheet:
    from allanite.experiments.planning import Plan
    from allanite.views.figures import plans

    many = list(plan) if isinstance(plan, (list, tuple)) else [plan]
    shown: list[Plan] = [Plan.from_json(one) if isinstance(one, Mapping) else one for one in many]
    panels = [plans.dwell_panel(shown)]
    return _column([*panels, plans.length_panel(shown[0])] if len(shown) == 1 else panels)


def _known_view(view: str, views: Sequence[str], what: str) -> None:
    if view not in views:
        raise InputError(f"no view {view!r} of {what}; there are: {', '.join(views)}")


def _in_view(parts: Parts, view: str, nothing: str) -> Sheet:
    """The panels of a view, or of all, one below the other; `nothing` says that there are none."""
    panels = [panel for name, make in parts.items() if view in ("whole", name) for panel in make()]
    if not panels:
        raise InputError(nothing)
    return _column(panels)


def _by_parts(module: str, what: str) -> Callable[..., Sheet]:
    """How results are drawn whose module of figures has `VIEWS` and `parts`."""

    def drawn(result: object, *, view: str = "whole") -> Sheet:
        figures = import_module(f"{__name__}.{module}")
        _known_view(view, figures.VIEWS, what)
        return _in_view(figures.parts(result), view, f"there is no figure {view!r} of {what}")

    return drawn


def _column(panels: Sequence[Panel]) -> Sheet:
    return Sheet(rows=tuple((panel,) for panel in panels))


def _document(name: str) -> Callable[[object], bool]:
    return lambda obj: isinstance(obj, Mapping) and obj.get("format") == name


def _all(matches: Callable[[object], bool]) -> Callable[[object], bool]:
    return lambda obj: isinstance(obj, (list, tuple)) and len(obj) > 0 and all(map(matches, obj))


def _holds(*names: str) -> Callable[[object], bool]:
    return lambda obj: isinstance(obj, Mapping) and all(name in obj for name in names)


def _named(name: str) -> Callable[[object], bool]:
    """By name, so that drawing one kind of result does not import all the others."""
    return lambda obj: any(kind.__name__ == name for kind in type(obj).__mro__)


#: Documents that hold the record which their figures show.
_WITH_THEIR_RECORD = frozenset({"allanite-earth-rate", "allanite-rate-vector"})

_DESCRIPTIONS: tuple[tuple[Callable[[object], bool], Callable[..., Sheet]], ...] = (
    (_named("Study"), _study),
    (_document("allanite-earth-rate"), _earth_rate),
    (_document("allanite-rate-vector"), _rate_vector),
    (_document("allanite-static-spans"), _static),
    (_holds("curve"), _channel),
    (_named("ChannelStudy"), _channel),
    (_holds("turns", "dwells", "positions"), _reversals),
    (_named("AllanCurve"), _curve),
    (_named("NoiseModel"), _model),
    (_named("OverFloor"), _over_floor),
    (_named("Recording"), _recording),
    (_named("Spectrum"), _spectrum),
    (_named("Spectra"), _spectra),
    (_named("Reversals"), _reversals),
    (_named("EarthRateEstimate"), _earth_rate),
    (_named("RateVector"), _rate_vector),
    (_named("FilterEstimate"), _filtered),
    (_named("Plan"), _plan),
    (_named("RateTableEstimate"), _rate_table),
    (_named("Combination"), _combination),
    (_named("Separation"), _by_parts("shared_noise", "sensors taken apart")),
    (_named("TermSelection"), _selection),
    (_named("Variation"), _variation),
    (_named("Comparison"), _comparison),
    (_named("EnvironmentFacts"), _environment),
    (_named("Environment"), _environment),
    (_named("PositionPlan"), _position_plan),
    (_named("DeadReckoning"), _dead_reckoning),
    (_named("DatasheetJudgement"), _datasheet),
    (_named("Bounds"), _by_parts("overbound", "bounds")),
    (_named("InMotion"), _by_parts("in_motion", "noise in motion")),
    (_named("Innovations"), _by_parts("innovations", "innovations")),
    (_named("FleetPopulation"), _fleet),
    (_named("ControlChart"), _control_chart),
    (_named("Difference"), _difference),
    (_named("StaticSpans"), _static),
    (_named("NorthEstimate"), _north),
    (_named("CalibrationEstimate"), _calibration),
    (_named("AlignmentEstimate"), _alignment),
    (_named("AidedTake"), _aided),
    (_all(_named("Plan")), _plan),
    (_all(_document("allanite-plan")), _plan),
    (_named("Sheet"), lambda sheet: sheet),
)
