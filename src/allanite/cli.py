# SPDX-License-Identifier: BSD-3-Clause
"""The command line. Each command parses, calls the library, and shows what came of it.

Results go to stdout, everything else to stderr. Exit codes: 0 done, 1 failed, 2 wrong usage, 3 finished with loss
(gaps, overloads or dropped rows in the record). Heavy modules load inside the commands, so that help is quick.
"""

from __future__ import annotations

import json
import re
import shlex
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from allanite import __version__
from allanite.errors import AllaniteError, DataQualityWarning

__all__ = ["cli", "main"]

LOSS = 3
STATISTICS = ("oadev", "adev", "mdev", "tdev", "hdev", "ohdev", "totdev")
ENGINES = ("exact", "decimated", "auto")
_SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0, "d": 86400.0, "w": 604800.0}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the program and leave it with its exit code."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a terminal without √ or µ shows a question mark
    warnings.showwarning = _show_warning
    try:
        code = cli.main(arguments, prog_name="allanite", standalone_mode=False)
    except AllaniteError as error:
        click.echo(f"allanite: {error}", err=True)
        code = 1
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("allanite: interrupted; no file was left half written", err=True)
        code = 130
    except BrokenPipeError:  # the reader of a pipe has seen enough
        sys.stderr.close()
        code = 0
    raise SystemExit(code if isinstance(code, int) else 0)


def _show_warning(message: Warning | str, category: type[Warning], *where: Any, **_: Any) -> None:
    if issubclass(category, DataQualityWarning):
        click.echo(f"allanite: note: {message}", err=True)


# -- kinds of options -------------------------------------------------------------------------------------


class Duration(click.ParamType[Any]):
    """A time span: seconds, or a number with ms, s, min, h, d or w."""

    name = "duration"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, (int, float)):
            return float(value)
        number, unit = re.fullmatch(r"(.*?)\s*([a-z]*)", str(value).strip(), re.S).groups()  # type: ignore[union-attr]
        try:
            return float(number) * _SECONDS[unit]
        except (KeyError, ValueError):
            self.fail(f"{value!r} is no time span: write 3600, 90s, 30min, 12h or 7d", param, ctx)


class ByChannel(click.ParamType[Any]):
    """One text for all channels, or one for each name or group: gyro=deg/s,acc=g."""

    name = "unit"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> str | dict[str, str]:
        if isinstance(value, dict) or "=" not in value:
            return value
        parts = [part.split("=", 1) for part in value.split(",")]
        if any(len(part) != 2 or not all(p.strip() for p in part) for part in parts):
            self.fail(f"{value!r}: write one unit for all channels, or gyro=deg/s,acc=g", param, ctx)
        return {name.strip(): unit.strip() for name, unit in parts}


class Names(click.ParamType[Any]):
    """Names with commas between them."""

    name = "names"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> list[str]:
        return (
            value if isinstance(value, list) else [part.strip() for part in value.split(",") if part.strip()]
        )


class Lags(click.ParamType[Any]):
    """octave, decade, all, a number of lags per decade, or averaging times with commas between them."""

    name = "lags"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value in ("octave", "decade", "all") or not isinstance(value, str):
            return value
        try:
            times = [float(part) for part in value.split(",")]
        except ValueError:
            self.fail(
                f"{value!r}: write octave, decade, all, a count per decade, or times like 0.1,1,10",
                param,
                ctx,
            )
        return int(times[0]) if len(times) == 1 and value.isdigit() else times


class FindingCode(click.ParamType[Any]):
    """Code of a finding."""

    name = "finding"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        from allanite.health import CATALOGUE

        if value not in CATALOGUE:
            self.fail(f"no finding is called {value!r}; there are: {', '.join(CATALOGUE)}", param, ctx)
        return str(value)


def log_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """What every command that reads a log understands."""
    options = [
        click.option("--unit", type=ByChannel(), help="Unit of the samples: deg/s, or gyro=deg/s,acc=g."),
        click.option("--rate", type=float, help="Samples per second, for a log without time."),
        click.option("--scale-factor", type=ByChannel(), help="Of a sensor read in volts or counts: '24 mV/(deg/s)'."),
        click.option("--sampling", type=click.Choice(["mean", "point"]), default="mean", show_default=True,
                     help="Samples are means over their interval, or values at an instant."),
        click.option("--channels", type=Names(), help="Names or groups to keep: gyro or gyro_x,gyro_y."),
        click.option("--from", "start", type=Duration(), help="Begin so long after the first sample."),
        click.option("--to", "stop", type=Duration(), help="End so long after the first sample."),
        click.option("--topic", help="Topic of a ROS log."),
        click.option("--variable", help="Array or table of a file with several."),
        click.option("--delimiter", help="Of a text file: , ; tab blank |"),
        click.option("--decimal", help="Decimal point or comma of a text file."),
    ]  # fmt: skip
    for option in reversed(options):
        command = option(command)
    return command


def force_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Files are not replaced without being asked to."""
    return click.option("--force", is_flag=True, help="Replace files that are there.")(command)


def accept_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Fatal findings are refused, one by one."""
    text = "Go on in spite of this finding (repeatable)."
    return click.option("--accept", type=FindingCode(), multiple=True, metavar="FINDING", help=text)(command)


def statistic_option(what: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Which deviation."""
    kind, text = click.Choice(STATISTICS), f"{what}: {', '.join(STATISTICS)}."
    return click.option(
        "--statistic", type=kind, metavar="NAME", default="oadev", show_default=True, help=text
    )


def json_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """For programs that read what we print."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else, on stdout.")(
        command
    )


def _place(name: str) -> Path:
    """A path; for "-" a file named stdin that holds what came through it, as long as the command runs."""
    if name != "-":
        return Path(name)
    folder = tempfile.TemporaryDirectory(prefix="allanite.")
    click.get_current_context().call_on_close(folder.cleanup)
    place = Path(folder.name) / "stdin"
    with place.open("wb") as file:
        shutil.copyfileobj(sys.stdin.buffer, file)
    return place


def _print_json(data: Any) -> None:
    click.echo(json.dumps(data, ensure_ascii=False, indent=1))


# -- commands ---------------------------------------------------------------------------------------------


_EXAMPLE = "\b\nExample:\n  {}"


@click.group(
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog=_EXAMPLE.format("allanite characterize gyro.csv --unit deg/s"),
)
@click.version_option(__version__, prog_name="allanite")
def cli() -> None:
    """From a log of a sensor at rest to a noise model you can trust."""


def command(example: str) -> Callable[[Callable[..., Any]], click.Command]:
    """A command of `cli` whose help ends with an example."""
    return cli.command(epilog=_EXAMPLE.format(example))


@command("allanite characterize imu.csv --unit gyro=deg/s,acc=g --from 10min --out results")
@click.argument("log")
@log_options
@click.option(
    "--out", type=click.Path(file_okay=False), help="Folder for the results.  [default: <log>-allanite]"
)
@accept_option
@statistic_option("Of the curve that is shown")
@click.option(
    "--plot", "figure", type=click.Path(dir_okay=False), help="Write the paper figure: .pdf, .svg or .png."
)
@force_option
@json_option
def characterize(
    log: str, out: str | None, accept: tuple[str, ...], statistic: str, figure: str | None, force: bool, as_json: bool,
    **options: Any,
) -> int:  # fmt: skip
    """Read a LOG of a sensor at rest, say what is wrong with it, and fit its noise model.

    Leaves report.html, study.json, allan.csv and imu.yaml in a folder. With --json the study goes to stdout alone,
    and files are written only where --out or --plot name them.
    """
    from allanite import delivery, terminal

    folder = out or (None if as_json else f"{'stdin' if log == '-' else Path(log).stem}-allanite")
    delivery.refuse_results(folder, figure, force=force)
    place, typed = _place(log), shlex.join(["allanite", *sys.argv[1:]])
    options |= {"command": typed, "source": "stdin" if log == "-" else None}
    with terminal.progress(quiet=as_json) as advance:
        study = delivery.study_of(place, accept=accept, statistic=statistic, progress=advance, **options)
    done = delivery.write_results(study, folder, figure, force=force)
    if as_json:
        _print_json(study.to_json())
    else:
        terminal.show_study(study.document, done.files, done.notes)
    return LOSS if delivery.is_lossy(study.document["findings"]) else 0


@command("allanite info imu.csv --unit gyro=deg/s,acc=g")
@click.argument("log")
@log_options
@json_option
def info(log: str, as_json: bool, **options: Any) -> int:
    """Show what a LOG holds: channels, rate, span, gaps, and what is wrong with it."""
    from allanite import delivery, health, terminal

    recording = delivery.read_part(_place(log), **options)
    with terminal.progress(quiet=as_json) as advance:
        facts = delivery.describe(recording, health.check(recording, progress=advance))
    if as_json:
        _print_json(facts)
    else:
        terminal.show_recording(facts)
    return LOSS if delivery.is_lossy(facts["findings"]) else 0


@command("allanite allan gyro.csv --unit deg/s --taus 10 -o allan.csv")
@click.argument("log")
@log_options
@click.option("--taus", type=Lags(), default="octave", show_default=True, help=Lags.__doc__)
@statistic_option("Of the curve")
@click.option(
    "--engine",
    type=click.Choice(ENGINES),
    metavar="NAME",
    default="auto",
    show_default=True,
    help="exact, decimated (fixed memory), or auto.",
)
@click.option("--confidence", type=float, default=0.95, show_default=True, help="Level of the intervals.")
@click.option("-o", "--output", help="Write the curve as CSV, from which it can be fitted; - for stdout.")
@click.option("--plot", "figure", type=click.Path(dir_okay=False), help="Draw it: .pdf, .svg or .png.")
@force_option
@json_option
def allan(
    log: str, taus: Any, statistic: str, engine: Any, confidence: float, output: str | None, figure: str | None,
    force: bool, as_json: bool, **options: Any,
) -> int:  # fmt: skip
    """Compute the Allan deviation of a LOG, and nothing else.

    Gaps and overloads are left out; no other fault is looked for: see `allanite info`.
    """
    from allanite import delivery, terminal
    from allanite.allan import allan_curve

    grid = {"taus": taus, "statistic": statistic, "engine": engine, "confidence": confidence}
    recording = delivery.read_part(_place(log), **options)
    with terminal.progress(quiet=as_json or output == "-") as advance:
        curve = allan_curve(recording, progress=advance, **grid)
    if figure is not None:
        delivery.save_figure(curve, figure, force=force)
    if output is not None:
        delivery.save_curve(curve, output, force=force)
    if as_json:
        _print_json({name: curve[name].to_json() for name in curve.names})
    elif output is None and figure is None:
        terminal.show_curve(curve)
    return LOSS if any(len(runs) for runs in curve.missing) else 0


@command("allanite fit allan.csv --json")
@click.argument("curve_or_log")
@log_options
@click.option(
    "--method",
    type=click.Choice(["moments", "slopes"]),
    default="moments",
    show_default=True,
    help="Full covariance with intervals, or the reading by slopes.",
)
@accept_option
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="Write the models as JSON.")
@force_option
@json_option
def fit(
    curve_or_log: str, method: str, accept: tuple[str, ...], output: str | None, force: bool, as_json: bool,
    **options: Any,
) -> int:  # fmt: skip
    """Fit noise models to a saved curve or to a log (CURVE_OR_LOG).

    Faults of a log are refused. The moment fit of a log keeps its spectral lines out; that of a curve cannot.
    """
    from allanite import delivery, model_file, terminal

    with terminal.progress(quiet=as_json) as advance:
        channels, lossy = delivery.fit_file(
            _place(curve_or_log), method=method, accept=accept, progress=advance, **options
        )
    models = {c["name"]: delivery.joined(c["models"]) for c in channels if c["models"]}
    if output is not None:
        model_file.save_models(models, output, force=force)
    if as_json:
        _print_json(models)
    else:
        terminal.show_models(channels)
    return LOSS if lossy else 0


@command("allanite simulate study.json --duration 7d --seed 1 -o twin.parquet")
@click.argument("model")
@click.option(
    "-o", "--output", required=True, type=click.Path(dir_okay=False), help=".parquet, .npy or .csv."
)
@click.option("--rate", type=float, help="Samples per second.  [default: that of the study]")
@click.option("--duration", type=Duration(), required=True, help="Length: 3600, 12h, 7d.")
@click.option("--seed", type=int, default=0, show_default=True, help="The same seed gives the same samples.")
@click.option("--sampling", type=click.Choice(["mean", "point"]), default="mean", show_default=True)
@click.option("--unit", type=ByChannel(), help="Unit to write the samples in.  [default: SI]")
@force_option
def simulate(
    model: str,
    output: str,
    rate: float | None,
    duration: float,
    seed: int,
    sampling: Any,
    unit: Any,
    force: bool,
) -> None:
    """Make a record of a sensor at rest from a MODEL.

    MODEL is a study, what `fit --json` printed, or words: 'N=0.3 deg/√h, B=5 deg/h, K=5 deg/h/√h'. With T=240s, B is
    that of a Gauss-Markov term.
    """
    from allanite import delivery, terminal

    with terminal.progress() as advance:
        written = delivery.simulate_to(
            _place(model), output, rate=rate, duration=duration, seed=seed, sampling=sampling, unit=unit,
            force=force, progress=advance,
        )  # fmt: skip
    click.echo(written)


@command("allanite convert imu.csv imu.parquet --unit gyro=deg/s,acc=g")
@click.argument("log")
@click.argument("output", type=click.Path(dir_okay=False))
@log_options
@force_option
def convert(log: str, output: str, force: bool, **options: Any) -> int:
    """Write any LOG that can be read as OUTPUT (.parquet, .npy or .csv).

    Parquet keeps rate, units, sampling and history; missing samples become nulls.
    """
    from allanite import delivery, recording_file, terminal

    recording = delivery.read_part(_place(log), **options)
    with terminal.progress() as advance:
        path = recording_file.write_recording(recording, output, force=force, progress=advance)
    click.echo(recording_file.summary(recording, path))
    return LOSS if delivery.has_gaps(recording) else 0


@command("allanite export kalibr results/study.json -o imu.yaml")
@click.argument("consumer")
@click.argument("study", type=click.Path(exists=True, dir_okay=False, allow_dash=True))
@click.option("-o", "--output", help="File to write.  [default: stdout]")
@click.option("--walk", help="What becomes of flicker: upper-bound, k-only or horizon=<seconds>.")
@click.option("--axes", help="One number for three axes: worst or rms.")
@click.option("--inflate", type=float, help="Factor on all numbers; it is written into the file.")
@click.option(
    "--correlation-time", type=Duration(), help="T of the Gauss-Markov term that stands for flicker."
)
@click.option("--rostopic", help="Topic to write into the file.")
@force_option
def export(consumer: str, study: str, output: str | None, force: bool, **options: Any) -> None:
    """Write a STUDY in the format of a CONSUMER: kalibr."""
    from allanite.exporters import export as write
    from allanite.study import Study

    target = None if output in (None, "-") else output
    chosen = {key: value for key, value in options.items() if value is not None}
    text = write(consumer, Study.load(_place(study)), target, force=force, **chosen)
    click.echo(text if target is None else target, nl=target is not None)


@command("allanite report results/study.json -o report.html")
@click.argument("study", type=click.Path(exists=True, dir_okay=False, allow_dash=True))
@click.option("-o", "--output", default="report.html", show_default=True, type=click.Path(dir_okay=False))
@force_option
def report(study: str, output: str, force: bool) -> None:
    """Write the report of a STUDY once more."""
    from allanite.report import render
    from allanite.study import Study

    click.echo(render(Study.load(_place(study)), output, force=force))
