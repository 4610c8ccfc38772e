# SPDX-License-Identifier: BSD-3-Clause
"""What a log holds, its curve, and models of it: info, allan, fit."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.completion import complete_files
from allanite.commands.cli.options import (
    ENGINES,
    Frequencies,
    Lags,
    accept_option,
    confidence_option,
    floor_option,
    force_option,
    json_option,
    log_options,
    place_of,
    print_json,
    statistic_option,
)
from allanite.commands.cli.program import LOSS, UNFIT, command
from allanite.plain_files.printable import printable

__all__ = ["allan", "fit", "info"]


@command("allanite info imu.csv --unit gyro=deg/s,acc=g")
@click.argument("log", shell_complete=complete_files)
@log_options
@json_option
def info(log: str, as_json: bool, **options: Any) -> int:
    """Show channels, rate, span, gaps and problems of a log.

    The exit code is that of `characterize`: 1 for a fatal finding, 3 for missing samples.
    """
    from allanite.commands.recordings import describe, is_lossy, read_part
    from allanite.recording.health.examination import check
    from allanite.views.terminal.console import progress
    from allanite.views.terminal.study import show_recording

    recording = read_part(place_of(log), **options)
    with progress(quiet=as_json) as advance:
        facts = describe(recording, check(recording, progress=advance), place_of(log))
    if as_json:
        print_json(facts)
    else:
        show_recording(facts)
    if any(f["severity"] == "fatal" for f in facts["findings"]):
        return UNFIT
    lost = facts["run"] and facts["run"]["losses"]
    return LOSS if lost or is_lossy(facts["findings"]) else 0


@command("allanite allan gyro.csv --unit deg/s --taus 10 -o allan.csv")
@click.argument("log", shell_complete=complete_files)
@log_options
@click.option("--taus", type=Lags(), default="octave", show_default=True, help=Lags.__doc__)
@statistic_option("Statistic", "mtie", "tierms")
@click.option(
    "--engine",
    type=click.Choice(ENGINES),
    metavar="NAME",
    default="auto",
    show_default=True,
    help="exact, decimated (bounded memory), or auto.",
)
@confidence_option
@floor_option
@click.option("-o", "--output", help="Output file for the curve (CSV, accepted by `fit`); - for stdout.")
@click.option("--plot", "figure", type=click.Path(dir_okay=False), help="Save a figure: .pdf, .svg or .png.")
@force_option
@json_option
def allan(
    log: str, taus: Any, statistic: str, engine: Any, confidence: float, floor: str | None, output: str | None,
    figure: str | None, force: bool, as_json: bool, **options: Any,
) -> int:  # fmt: skip
    """Compute the Allan deviation, without a fit.

    Gaps and overloads are excluded. Other problems are not checked: see `allanite info`.
    """
    from allanite.commands.curves import interval_errors_of, over_floor_of, plain_curves, save_curve
    from allanite.commands.pictures import refuse_figure, save_figure
    from allanite.commands.recordings import read_part
    from allanite.errors import InputError
    from allanite.noise.allan import allan_curve
    from allanite.views.terminal.console import progress
    from allanite.views.terminal.study import show_curve, show_interval_errors

    if statistic in ("mtie", "tierms"):
        if floor is not None or output is not None or figure is not None:
            raise InputError(
                f"{statistic} is printed, as a table or as --json; --floor, -o and --plot take deviations"
            )
        errors = interval_errors_of(place_of(log), statistic=statistic, taus=taus, **options)
        if as_json:
            print_json({e.name: e.to_json() for e in errors})
        else:
            show_interval_errors(errors)
        return 0
    if figure is not None:
        refuse_figure(figure, force=force)
    grid = {"taus": taus, "statistic": statistic, "engine": engine, "confidence": confidence}
    recording = read_part(place_of(log), **options)
    with progress(quiet=as_json or output == "-") as advance:
        curve = allan_curve(recording, progress=advance, **grid)
    shown = curve if floor is None else over_floor_of(curve, recording, floor, **options)
    if figure is not None:
        save_figure(shown, figure, force=force)
    if output is not None:
        save_curve(shown, output, force=force)
    if as_json:
        print_json(plain_curves(shown))
    elif output is None and figure is None:
        show_curve(shown)
    return LOSS if any(len(runs) for runs in curve.missing) else 0


@command("allanite fit allan.csv --json")
@click.argument("curve_or_log", shell_complete=complete_files)
@log_options
@click.option("--curve", is_flag=True, help="The file is an Allan curve from another program.")
@click.option("--samples", type=int, help="Number of samples behind the curve, if it has no counts.")
@click.option(
    "--statistic",
    metavar="NAME",
    help="Statistic of the curve, if its headings do not name it: oadev, adev, oavar or avar.",
)
@click.option(
    "--method",
    type=click.Choice(["moments", "slopes", "likelihood", "spectral"]),
    default="moments",
    show_default=True,
    help="For a curve: full covariance (moments) or slope reading. For a log: likelihood or spectral.",
)
@click.option(
    "--terms",
    metavar="LETTERS",
    help="Terms to fit by likelihood or spectrum: letters of Q N B K R, and G once or twice, as in NGGK.",
)
@click.option(
    "--lines",
    metavar="FREQUENCIES",
    type=Frequencies(),
    help="Spectral lines to fit with the noise, by likelihood: auto (the steady ones of the spectrum), none, or "
    "frequencies in Hz like 12.3,50.  [default: auto]",
)
@floor_option
@accept_option
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="Output file for the models (JSON).")
@force_option
@json_option
@click.option("--si", is_flag=True, help="Print coefficients in SI units.")
def fit(
    curve_or_log: str, method: str, terms: str | None, lines: Any, floor: str | None, accept: tuple[str, ...],
    output: str | None, force: bool, as_json: bool, si: bool, **options: Any,
) -> int:  # fmt: skip
    """Fit a noise model to an Allan curve or to samples.

    CURVE_OR_LOG is a curve that `allan` saved, a curve from another program (--curve), or a log. A log with fatal
    findings is refused. Steady spectral lines of a log are removed or, by likelihood, fitted with the noise; a fit to
    a curve cannot do that.
    """
    from allanite.commands.curves import fit_file
    from allanite.study import model_file
    from allanite.views.terminal.console import progress
    from allanite.views.terminal.page import show_models
    from allanite.views.terminal.style import TerminalStyle

    with progress(quiet=as_json) as advance:
        fitted = fit_file(
            place_of(curve_or_log),
            method=method,
            terms=terms,
            lines=lines,
            floor=floor,
            accept=accept,
            progress=advance,
            **options,
        )
    for remark in fitted.remarks:
        click.echo(f"allanite: note: {printable(remark)}", err=True)
    if output is not None:
        model_file.save_models(fitted.models, output, force=force)
    if as_json:
        print_json({name: model.to_json() for name, model in fitted.models.items()})
    else:
        show_models(fitted.channels, style=TerminalStyle(si=si))
    return LOSS if fitted.lossy else 0
