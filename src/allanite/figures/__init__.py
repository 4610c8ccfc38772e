# SPDX-License-Identifier: BSD-3-Clause
"""Figures of every result: `plot` says what is shown, two thin renderers draw it, on paper and on screen alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

from allanite.errors import InputError
from allanite.figures.panel import Panel, Sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure as PaperFigure
    from plotly.graph_objects import Figure as ScreenFigure

__all__ = ["plot", "sheet_of"]

Json = Mapping[str, Any]


@overload
def plot(obj: object, *, interactive: Literal[False] = False, **options: Any) -> PaperFigure: ...
@overload
def plot(obj: object, *, interactive: Literal[True], **options: Any) -> ScreenFigure: ...
def plot(obj: object, *, interactive: bool = False, **options: Any) -> PaperFigure | ScreenFigure:
    """Draw any result.

    Parameters
    ----------
    obj : Study, AllanCurve, NoiseModel, Recording, Spectrum, or one entry of a study's "channels"
    interactive : bool
        False: a Matplotlib figure, for ``savefig("curve.pdf")``. True: a Plotly figure, which needs no network.
    **options
        Study: `view` ("channels": each channel with its terms; "groups": all axes of a kind together; "spectrum";
        "record") and `channels`, names of those wanted. Channel entry: `view`. AllanCurve: `model`, a NoiseModel to
        draw over it. NoiseModel: `tau`, the two ends [s]. Recording: `channels`. Spectrum: `kind` of its channel.

    Returns
    -------
    matplotlib.figure.Figure or plotly.graph_objects.Figure

    Raises
    ------
    InputError
        Nothing that has a figure, an unknown option, or an unknown channel.

    Examples
    --------
    >>> import allanite as al
    >>> from allanite.noise import RandomWalk, White
    >>> figure = al.plot(al.NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-6)))
    >>> figure.savefig("model.pdf")  # doctest: +SKIP
    """
    sheet = sheet_of(obj, **options)
    if interactive:
        from allanite.figures.plotly import figure as screen

        return screen(sheet)
    from allanite.figures.matplotlib import figure as paper

    return paper(sheet)


def sheet_of(obj: object, **options: Any) -> Sheet:
    """What `plot` would draw, without a plotting library."""
    for matches, describe in _DESCRIPTIONS:
        if matches(obj):
            try:
                return describe(obj, **options)
            except TypeError as error:
                if "unexpected keyword" not in str(error):
                    raise
                raise InputError(f"{error}: not an option of the figure of a {type(obj).__name__}") from None
    raise InputError(
        f"no figure for a {type(obj).__name__}: give a Study, an AllanCurve, a NoiseModel, a Recording, a Spectrum, "
        "or an entry of a study's channels"
    )


# -- one function per thing that has a figure --------------------------------------------------------------


def _study(study: Any, *, view: str = "channels", channels: Sequence[str] | None = None) -> Sheet:
    from allanite.wording import groups

    document = study if isinstance(study, Mapping) else study.to_json()
    found = groups(_chosen(document["channels"], channels))
    return Sheet(rows=tuple(row for group in found for row in _view(view)(group, document)))


def _channel(channel: Json, *, view: str = "channels") -> Sheet:
    from allanite.wording import groups

    recording: Json = {"rate": 1.0, "gaps": [], "duration": max(channel["overview"]["t"], default=1.0)}
    document = {"recording": recording, "findings": [], "channels": [channel]}
    return Sheet(rows=tuple(_view(view)(groups([channel])[0], document)))


def _view(name: str) -> Callable[[Any, Json], list[tuple[Panel, ...]]]:
    from allanite.figures import curves, records, spectra

    views: dict[str, Callable[[Any, Json], list[tuple[Panel, ...]]]] = {
        "channels": lambda group, _: _rows_of(curves.channel_panels(group)),
        "groups": lambda group, _: [(curves.group_panel(group),)],
        "spectrum": lambda group, _: [(spectra.group_spectrum_panel(group),)],
        "record": lambda group, document: [(p,) for p in records.group_record_panels(group, document)],
    }
    if name not in views:
        raise InputError(f"no view {name!r} of a study; there are: {', '.join(views)}")
    return views[name]


def _rows_of(panels: Sequence[Panel], most: int = 3) -> list[tuple[Panel, ...]]:
    return [tuple(panels[i : i + most]) for i in range(0, len(panels), most)]


def _chosen(channels: Sequence[Json], names: Sequence[str] | None) -> list[Json]:
    if names is None:
        return list(channels)
    wanted = [names] if isinstance(names, str) else list(names)
    known = {c["name"]: c for c in channels}
    for name in wanted:
        if name not in known:
            raise InputError(f"no channel {name!r}; there are: {', '.join(known)}")
    return [known[name] for name in wanted]


def _curve(curve: Any, *, model: Any = None) -> Sheet:
    from allanite.figures.curves import curve_panels

    return Sheet(rows=tuple((panel,) for panel in curve_panels(curve, model)))


def _model(model: Any, *, tau: tuple[float, float] = (1e-2, 1e5)) -> Sheet:
    from allanite.figures.curves import model_panel

    return Sheet(rows=((model_panel(model, tau),),))


def _recording(recording: Any, *, channels: Sequence[str] | None = None) -> Sheet:
    from allanite.figures.records import recording_panels

    return Sheet(rows=tuple((panel,) for panel in recording_panels(recording, channels)))


def _spectrum(spectrum: Any, *, kind: str = "unknown", unit: str = "SI unit") -> Sheet:
    from allanite.figures.spectra import spectrum_panel

    return Sheet(rows=((spectrum_panel(spectrum, kind, unit),),))


def _named(name: str) -> Callable[[object], bool]:
    """By name, so that drawing one kind of result does not import all the others."""
    return lambda obj: any(kind.__name__ == name for kind in type(obj).__mro__)


_DESCRIPTIONS: tuple[tuple[Callable[[object], bool], Callable[..., Sheet]], ...] = (
    (_named("Study"), _study),
    (lambda obj: isinstance(obj, Mapping) and obj.get("format") == "allanite-study", _study),
    (lambda obj: isinstance(obj, Mapping) and "curve" in obj, _channel),
    (_named("AllanCurve"), _curve),
    (_named("NoiseModel"), _model),
    (_named("Recording"), _recording),
    (_named("Spectrum"), _spectrum),
)
