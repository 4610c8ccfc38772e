# SPDX-License-Identifier: BSD-3-Clause
"""What becomes of many hostile files: they are opened in forks that have the limits of a reader's child.

A reader starts a fresh interpreter for every file, which costs a third of a second. Here one interpreter imports all
once, and forks for every job, and again for every few files: in that fork the child's part runs with its limits, then
the parent's part. What ends its fork, or fails in any other way, is opened once more alone. A signal is what the real
reader reports as a FormatError.
"""

from __future__ import annotations

import atexit
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np

from allanite.errors import FormatError, InputError, LimitError

__all__ = [
    "CODES",
    "MOST_MEMORY",
    "MOST_SECONDS",
    "PATCHED",
    "ROLES",
    "Attempt",
    "Outcome",
    "fault_of",
    "inline",
    "measured",
    "mutations",
    "outcomes",
    "tally",
]

CODES = {10: "read", 11: "refused", 12: "another error"}
#: What opening a file may take: processor time [s], and resident memory [bytes].
MOST_SECONDS: Final = 10
MOST_MEMORY: Final = 512 << 20
_TOGETHER = 50  # files that are opened by one process
#: Readers whose parsers run in a child of their own.
PATCHED = ("ardupilot", "ulog", "tdms", "hdf5", "matlab", "rosbag", "spreadsheet", "mavlink", "r_data")
#: Imported before the first fork: what the libraries need for themselves does not count.
_IMPORTED = (
    "allanite.recording.calibration", "allanite.commands.cli", "allanite.study.datasheet", "allanite.commands",
    "allanite.views.terminal.page", "allanite.views.terminal.study",
    "allanite.acquisition.instruments.serial_imu.description", "allanite.files.store", "allanite.study.model_file",
    "allanite.files.readers.raw_layout", "allanite.study.results", "h5py", "nptdms", "pyarrow.csv", "pyarrow.feather",
    "pyarrow.ipc", "pyarrow.parquet", "pymavlink.dialects.v20.common", "python_calamine", "pyulog", "rdata",
    "rosbags.typesys", "ruamel.yaml", "scipy.io",
    *(f"allanite.files.readers.{name}" for name in (*PATCHED, "text", "run", "parquet", "numpy_file")),
    "allanite.files.readers.rosbag.table", "allanite.files.readers.ardupilot.parts",
)  # fmt: skip
_HARNESS = "import sys; sys.path.insert(0, sys.argv[1]); import hostile_files; hostile_files.serve()"


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """A file, how it is opened (see `ROLES`), and with which options of `read`."""

    path: Path
    role: str = "log"
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a file.

    Attributes
    ----------
    code : int
        See `CODES`, or less the number of the signal that ended the process.
    message : str
        Of the refusal, or the traceback of another error.
    seconds : float [s]
        Processor time.
    memory : int [bytes]
        Largest resident size of the process, with all that was imported, and of what it opened before.
    """

    code: int
    message: str
    seconds: float
    memory: int


# -- how files are opened ----------------------------------------------------------------------------------


def _log(path: Path, options: Mapping[str, Any]) -> None:
    from allanite.files.readers import read

    recording = read(path, **options)
    for name in recording.names:
        recording.values(name)


def _raw(path: Path, options: Mapping[str, Any]) -> None:
    """The file is the layout of samples that are there."""
    samples = path.with_name("samples.raw")
    samples.write_bytes((b"\xa5\x5a" + bytes(14)) * 256)
    _log(samples, {"layout": path})


def _run(path: Path, options: Mapping[str, Any]) -> None:
    from allanite.files.store import open_run, recover

    def followed() -> None:
        run = open_run(path)
        _, position = run.tail()
        run.tail(position)

    def rescued() -> None:
        recover(path, path.with_name("recovered"))

    _every(lambda: _log(path, {}), lambda: recover(path, None), followed, rescued)


def _info(path: Path, options: Mapping[str, Any]) -> None:
    """By the command line, which has the last word on every error."""
    from allanite.commands.cli import main

    given = [f"--{key}={value}" for key, value in options.items() if key != "layout"]
    if "layout" in options:
        layout = path.with_name("layout.yaml")
        layout.write_text(json.dumps(options["layout"]), encoding="utf-8")
        given.append(f"--layout={layout}")
    try:
        main(["info", str(path), *given])
    except SystemExit as end:
        if end.code not in (0, 1, 3):
            raise AssertionError(f"the command ended with exit code {end.code}") from None
        if end.code == 1:
            raise InputError("refused by the command line") from None


def _every(*calls: Callable[[], Any]) -> None:
    """All of them, though one refuses."""
    from allanite.errors import AllaniteError

    refusals = []
    for call in calls:
        try:
            call()
        except AllaniteError as error:
            refusals.append(error)
    if refusals:
        raise refusals[0]


def _layout(path: Path, options: Mapping[str, Any]) -> None:
    from allanite.files.readers.raw_layout import read_layout

    read_layout(path)


def _device(path: Path, options: Mapping[str, Any]) -> None:
    from allanite.acquisition.instruments.serial_imu.description import read_description

    read_description(path)


def _datasheet(path: Path, options: Mapping[str, Any]) -> None:
    from allanite.study.datasheet import read_datasheet

    read_datasheet(path)


def _model(path: Path, options: Mapping[str, Any]) -> None:
    from allanite.study.model_file import load_models

    load_models(path)


def _study(path: Path, options: Mapping[str, Any]) -> None:
    from allanite.study.study import Study

    study = Study.load(path)
    study.models, study.findings, study.to_json()


def _calibration(path: Path, options: Mapping[str, Any]) -> None:
    from allanite.recording.calibration import Calibration

    Calibration.load(path)


def _curve(path: Path, options: Mapping[str, Any]) -> None:
    """Of allanite or of another program: either reader has its own errors only."""
    from allanite.errors import AllaniteError
    from allanite.files.foreign_curves import read_curve
    from allanite.noise.allan import AllanCurve

    try:
        AllanCurve.from_csv(path)
    except AllaniteError:
        read_curve(path, **options)


def _clock(path: Path, options: Mapping[str, Any]) -> None:
    _log(path, {"kind": "phase", "unit": "ns", "rate": 1.0, **options})


#: How a file is opened.
ROLES: Final[dict[str, Callable[[Path, Mapping[str, Any]], None]]] = {
    "log": _log,
    "raw": _raw,
    "run": _run,
    "info": _info,
    "layout": _layout,
    "device": _device,
    "datasheet": _datasheet,
    "model": _model,
    "study": _study,
    "calibration": _calibration,
    "curve": _curve,
    "clock": _clock,
}


# -- in the process that is forked -------------------------------------------------------------------------


def inline(function: str, arguments: Sequence[str], **limits: Any) -> tuple[Any, dict[str, Any]]:
    """`allanite.files.readers.sandbox.run` without the process: the same function, its errors classified as there."""
    module, _, name = function.partition(":")
    try:
        data, arrays = getattr(import_module(module), name)(*arguments)
    except (FormatError, InputError, LimitError):
        raise
    except MemoryError:
        raise LimitError("needs more memory") from None
    except Exception as error:  # noqa: BLE001  (whatever a parser raises is the report)
        raise FormatError(f"damaged or unsupported ({type(error).__name__}: {error})") from None
    return json.loads(json.dumps(data)), arrays


def serve() -> None:
    """Import all, then answer jobs, a line each, from a fork each: no job sees what another one has changed."""
    for name in _IMPORTED:
        import_module(name)
    _warm_up()
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            answer: dict[str, Any] = {}
            try:
                answer = {"outcomes": forked(json.loads(line))}
            except BaseException:  # noqa: BLE001 - is the report
                answer = {"failed": traceback.format_exc()}
            finally:
                print(json.dumps(answer), flush=True)
                os._exit(0)
        _, status = os.waitpid(child, 0)
        if status:
            print(json.dumps({"failed": f"the fork of the job ended with status {status}"}), flush=True)


def forked(job: Mapping[str, Any]) -> list[list[Any]]:
    """Open the files of a job, some in each fork; the fields of `Outcome`."""
    for name in () if job["in_children"] else PATCHED:
        vars(import_module(f"allanite.files.readers.{name}"))["run"] = inline
    if job["sound"]:
        _log(Path(job["sound"]), job["options"])  # what is imported on use is imported before the first fork
    attempts, found = job["attempts"], list[list[Any]]()
    limited = not job["in_children"]  # else the children have limits of their own
    while len(found) < len(attempts):
        some = attempts[len(found) : len(found) + _TOGETHER]
        done = _together(some, job["seconds"], limited=limited)
        for one, outcome in zip(some, done, strict=False):
            # Alone once more: what others in the same process have left must not count.
            suspect = len(some) > 1 and fault_of(Outcome(*outcome)) != ""
            found.append(_together([one], job["seconds"], limited=limited)[0] if suspect else outcome)
        if len(done) < len(some):
            found.append(_together([some[len(done)]], job["seconds"], limited=limited)[0])
    return found


def _warm_up() -> None:
    """Read and write once: what is imported on use is imported before the first fork."""
    from allanite.files.store import recover
    from allanite.plain_files.yaml_text import read_yaml

    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "a.csv").write_text(
            "t,wx\n" + "".join(f"{k / 10},{k % 7}.5\n" for k in range(50)), encoding="utf-8"
        )
        (folder / "a.yaml").write_text("a: [1, 2.5, b]\n", encoding="utf-8")
        _log(folder / "a.csv", {})
        read_yaml(folder / "a.yaml", "file")
        sample = Path(__file__).parent / "samples" / "run" / "finished"
        _log(sample, {})
        recover(sample, folder / "recovered")


def _together(attempts: Sequence[Mapping[str, Any]], seconds: int, *, limited: bool) -> list[list[Any]]:
    """Open files one after another in one fork; fewer outcomes than files if one of several ended it."""
    with tempfile.TemporaryFile() as report, tempfile.TemporaryFile() as errors:
        child = os.fork()
        if child == 0:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.dup2(errors.fileno(), 2)
            _attempt_all(attempts, seconds, report.fileno(), limited=limited)
            os._exit(0)
        _, status, used = os.wait4(child, 0)
        report.seek(0)
        errors.seek(0)
        found = [json.loads(line) for line in report.read().splitlines()]
        said = errors.read(1 << 16).decode("utf-8", "replace")
    if len(found) < len(attempts) == 1:
        code = -os.WTERMSIG(status)
        if code == -signal.SIGABRT and "memory allocation of " in said:  # as `sandbox.run` has it
            code = 11
        found.append([code, said, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024])
    return found


def _attempt_all(attempts: Sequence[Mapping[str, Any]], seconds: int, report: int, *, limited: bool) -> None:
    """Open files in the fork, and write a line for each."""
    from allanite.files.readers.sandbox import limit

    if limited:
        limit(MOST_MEMORY, seconds)
    for attempt in attempts:
        begun = time.process_time()
        _, hard = resource.getrlimit(resource.RLIMIT_CPU)
        with suppress(ValueError):  # the hard limit is that of the first
            resource.setrlimit(resource.RLIMIT_CPU, (round(begun) + 1 + seconds, hard))
        signal.alarm(6 * seconds)
        code, message = _attempt(attempt)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        line = json.dumps([code, message, time.process_time() - begun, memory])
        os.write(report, line.encode() + b"\n")


def _attempt(attempt: Mapping[str, Any]) -> tuple[int, str]:
    """Open a file; its code and message."""
    from allanite.errors import AllaniteError

    try:
        ROLES[attempt["role"]](Path(attempt["path"]), attempt["options"])
    except AllaniteError as error:
        return 11, f"{type(error).__name__}: {error}"[:2000]
    except BaseException:  # noqa: BLE001 - is the report
        return 12, traceback.format_exc()[-3000:]
    return 10, ""


# -- from outside ------------------------------------------------------------------------------------------


def measured(
    attempts: Sequence[Attempt],
    *,
    sound: Path | None = None,
    options: Mapping[str, Any] | None = None,
    seconds: int = MOST_SECONDS,
    in_children: bool = False,
) -> list[Outcome]:
    """What becomes of files.

    Parameters
    ----------
    attempts : sequence of Attempt
    sound, options : Path, mapping
        A file of the same format that can be read: it is read once in the process that is forked.
    seconds : int [s]
        Processor time for each; the wall clock may show six times as much.
    in_children : bool
        Parsers run in children of their own, as they do for a user: one that dies is a refusal.
    """
    job = {
        "sound": "" if sound is None else str(sound),
        "options": dict(options or {}),
        "attempts": [{"path": str(a.path), "role": a.role, "options": dict(a.options)} for a in attempts],
        "seconds": seconds,
        "in_children": in_children,
    }
    server = _server()
    assert server.stdin is not None and server.stdout is not None
    server.stdin.write(json.dumps(job) + "\n")
    server.stdin.flush()
    answer = json.loads(server.stdout.readline() or '{"failed": "the server has ended"}')
    assert "failed" not in answer, answer["failed"][-2000:]
    return [Outcome(*fields) for fields in answer["outcomes"]]


@cache
def _server() -> subprocess.Popen[str]:
    """The interpreter that forks: one for this process, ended with it."""
    command = [sys.executable, "-c", _HARNESS, str(Path(__file__).parent)]
    server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def end() -> None:
        server.communicate()  # closes its stdin

    atexit.register(end)
    return server


def fault_of(found: Outcome) -> str:
    """What is wrong with what became of a file; "" if nothing is."""
    if found.code not in (10, 11):
        said = found.message.strip().splitlines()
        return f"{CODES.get(found.code, f'signal {-found.code}')}: {said[-1] if said else ''}"
    if found.seconds > MOST_SECONDS:
        return f"{found.seconds:.1f} s of processor time"
    return f"{found.memory >> 20} MiB" if found.memory > MOST_MEMORY else ""


def outcomes(
    sound: Path, paths: Sequence[Path], options: dict[str, Any] | None = None, *, seconds: int = 10
) -> list[int]:
    """Exit code of every file (see `CODES`), or less the number of the signal that ended its process.

    `sound` is a file of the same format that can be read.
    """
    attempts = [Attempt(path=path, options=options or {}) for path in paths]
    found = measured(attempts, sound=sound, options=options, seconds=seconds)
    wrong = [one.message for one in found if one.code == 12]
    assert not wrong, wrong[0]
    return [one.code for one in found]


def mutations(content: bytes, count: int, seed: int = 20261122) -> list[bytes]:
    """Copies with one to five bytes changed anywhere or in the first kilobyte; every tenth is cut as well."""
    rng = np.random.default_rng(seed)
    made = []
    for k in range(count):
        copy = bytearray(content)
        reach = len(copy) if rng.random() < 0.5 else min(len(copy), 1024)
        for place in rng.integers(0, reach, size=rng.integers(1, 6)):
            copy[place] = rng.integers(0, 256)
        made.append(bytes(copy[: rng.integers(1, len(copy))] if k % 10 == 9 else copy))
    return made


def tally(found: Sequence[int]) -> dict[str, int]:
    """How many files came to what."""
    return dict(Counter(CODES.get(code, f"signal {-code}") for code in found))
