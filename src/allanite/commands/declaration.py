# SPDX-License-Identifier: BSD-3-Clause
"""A command that yields a document of logs, models or files, declared once for the command line and the page."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

from allanite.commands.option import Option
from allanite.commands.rules import Rule
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult
    from allanite.quantities.result import Result

__all__ = ["Command", "Place", "Subject", "loaded"]

Place = str | os.PathLike[str]
Advance = Callable[[float, str], None]
Subject = Literal["recording", "recordings", "model", "pair", "study", "sheet", "fleet"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """What a user can ask of a log, of several, of a model, or of what was measured before.

    Attributes
    ----------
    name : str
        Of the command, and of its document; "plan positions" stands below "plan".
    title : str
        What the page calls it.
    summary, details : str
        One sentence, and what else its help says.
    example : str
    group : str
        Purpose under which ``allanite --help`` lists it; "" where the list there names it.
    options : tuple of Option
        Besides those of reading a log and of where the result goes; `run` takes each under its name.
    takes : str
        "recording"; "recordings": two or more, which `work` gets in a list; "model": no log, but the noise models that
        an option names; "pair", two of them; "study", the file of one; "sheet", a data sheet, with a log or a study as
        an option; or "fleet", the table of a fleet or its folder.
    run : str
        "module:function" that makes a `Result` of a recording; "" where `work` does more than that.
    work : str
        "module:function" that takes what `measure` takes, where reading a log, or looking for faults in it, is a part
        of the measurement; "" where `run` is enough.
    tables : mapping of str to str
        Further files: "module:function" that makes the rows of a table out of the result, by file name.
    document : str
        Name of its document, where it is not that of the command.
    documents : tuple of str
        Files that may hold its document in place of that.
    logs : str
        What its help calls the logs that it takes, where their order matters.
    further : tuple of str
        Files that `work` leaves beside its document and report, and that are no tables.
    series : str
        What the recording is called that its `--output` writes; "" where it leaves none.
    models : str
        What the noise models are called that its `--output` writes; "" where it leaves none.
    folder : str
        Where its files go if nobody says so; "" for nowhere.
    rules : tuple of Rule
        Options that exclude or need each other.
    positions : str
        What the help says of the logs where there is one for each position: "with its heading: north.csv=0"; "" for a
        command of one log. `work` gets them as a mapping of path to heading [rad].
    headed : str
        How such logs with their headings are written: "north.csv=0 east.csv=90".
    headings : str
        "needed" of each of them, "possible", or "none": `work` gets a list of paths then.
    on_page : bool
        The page offers it: it needs no file but logs, models and lists.
    judged_here : collection of str
        Codes of findings that the measurement comes to itself.
    brief : bool
        The work is too short for a progress bar.
    summarized : bool
        A terminal shows a summary, which options unfold: --details, --si, --quiet.
    """

    name: str
    title: str
    summary: str
    details: str
    example: str
    options: tuple[Option, ...]
    group: str = ""
    takes: Subject = "recording"
    logs: str = ""
    run: str = ""
    work: str = ""
    tables: Mapping[str, str] = field(default_factory=dict)
    document: str = ""
    documents: tuple[str, ...] = ()
    further: tuple[str, ...] = ()
    series: str = ""
    models: str = ""
    folder: str = ""
    rules: tuple[Rule, ...] = ()
    positions: str = ""
    headed: str = ""
    headings: Literal["needed", "possible", "none"] = "possible"
    on_page: bool = True
    judged_here: Collection[str] = ()
    brief: bool = False
    summarized: bool = False

    @property
    def stem(self) -> str:
        """Of the file of its document."""
        return self.document or self.name

    @property
    def reads(self) -> bool:
        """It reads a log, and so takes the options of reading."""
        return self.takes in ("recording", "recordings", "sheet")

    @property
    def beside(self) -> tuple[str, ...]:
        """Files beside its document and report."""
        return (*self.tables, *self.further)

    def refusal(self, options: Mapping[str, object]) -> str:
        """What is wrong with options together; "" where nothing is."""
        usual = {o.python: o.default for o in self.options}
        given = {
            name: value
            for name, value in options.items()
            if value is not None and value is not False and value != usual.get(name)
        }
        return next((rule.says for rule in self.rules if rule.broken(given)), "")

    def measure(
        self,
        log: Place | Sequence[Place] = (),
        /,
        *,
        accept: Collection[str] = (),
        model: Place | None = None,
        command: str | None = None,
        source: str | None = None,
        progress: Advance | None = None,
        **options: object,
    ) -> MeasurementResult:
        """Carry it out on a log, or on several.

        Parameters
        ----------
        log : path, or sequence of path
            None where it takes models.
        accept : collection of str
            Codes of fatal findings to go on in spite of.
        model : path, optional
            Of every channel by its name, or one for all; by default the fit to the log itself.
        command : str, optional
            As it was typed.
        source : str, optional
            In place of the name of the file.
        **options
            Those of the command, and those of `read`.

        Raises
        ------
        InputError
            Options that exclude each other.
        DataQualityError
            A fatal finding that was not accepted.
        """
        if refusal := self.refusal(options):
            raise InputError(refusal)
        make: Callable[..., MeasurementResult] = self._by_work if self.work else self._by_run
        measured = make(
            log, accept=accept, model=model, command=command, source=source, progress=progress, **options
        )
        if measured.name != self.stem:  # another result behind the same name, with tables of its own
            return measured
        tables: dict[str, Callable[[Result], Iterable[dict[str, object]]]] = {
            file: loaded(rows) for file, rows in self.tables.items()
        }
        made = {file: [*rows(measured.result)] for file, rows in tables.items()}
        return replace(measured, tables={**measured.tables, **{f: rows for f, rows in made.items() if rows}})

    def _by_work(self, log: Place | Sequence[Place], /, **options: object) -> MeasurementResult:
        """What the work does not take is left out."""
        work: Callable[..., MeasurementResult] = loaded(self.work)
        of_log = {"source"} if self.takes in ("recording", "sheet") else set()
        declared = {o.python for o in self.options} | of_log
        left_out = {"accept", "model", "source"} - declared | ({"progress"} if self.brief else set())
        kept = {name: value for name, value in options.items() if name not in left_out}
        return work(**kept) if self.takes == "model" else work(log, **kept)

    def _by_run(
        self,
        log: Place,
        /,
        *,
        accept: Collection[str],
        model: Place | None,
        command: str | None,
        source: str | None,
        progress: Advance | None,
        **options: Any,
    ) -> MeasurementResult:
        """Read a log, refuse its faults, and make the result of what is left."""
        from allanite.commands.measurement import MeasurementResult, origin_of
        from allanite.commands.recordings import has_gaps, models_from, noise_channels, ready_log
        from allanite.study.result_document import ResultDocument

        advance = progress or (lambda fraction, what: None)
        of_command = {o.python: options.pop(o.python) for o in self.options if o.python in options}
        recording, findings = ready_log(
            log,
            accept=accept,
            judged_elsewhere=self.judged_here,
            source=source,
            progress=lambda fraction, what: advance(0.3 * fraction, what),
            **options,
        )
        if model is not None:
            of_command["models"] = models_from(model, noise_channels(recording))
        run: Callable[..., Result] = loaded(self.run)
        result = run(
            recording, progress=lambda fraction, what: advance(0.3 + 0.7 * fraction, what), **of_command
        )
        return MeasurementResult(
            result=result,
            document=ResultDocument(
                result=result,
                model_name="" if model is None else str(model),
                **origin_of(recording, findings, log, command),
            ),
            name=self.stem,
            tables={},
            lossy=has_gaps(recording),
        )


def loaded(dotted: str) -> Any:
    """A function by "module:name"."""
    module, _, name = dotted.partition(":")
    return getattr(import_module(module), name)
