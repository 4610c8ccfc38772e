# SPDX-License-Identifier: BSD-3-Clause
"""Run a parser that may crash, in a child process with limits of memory and time.

A damaged file can kill a parser written in C. In a child that costs a `FormatError`, not the session. The child
is a fresh interpreter (no fork: the parent may hold threads); it hands arrays back as .npy files in a folder
that the parent maps and removes, and everything else as JSON.
"""

from __future__ import annotations

import json
import mmap
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, FormatError, InputError, LimitError, StorageError
from allanite.plain_files.process_limits import limit_memory, limit_processor_time

__all__ = ["Outcome", "limit", "run"]

_ERRORS = {e.__name__: e for e in (DataQualityError, FormatError, InputError, LimitError, StorageError)}
#: What libraries in Rust and C++ say before they abort for want of memory.
_NO_MEMORY = (b"memory allocation of ", b"bad_alloc")
#: The folder is removed while its arrays live on; Windows keeps a file that is mapped.
_MAPPED: Final = None if os.name == "nt" else "r"
_CHILD = "from allanite.files.readers.sandbox import _child; _child()"

Outcome = tuple[Any, dict[str, NDArray[Any]]]


def run(
    function: str,
    arguments: Sequence[Any],
    *,
    imports: Sequence[str] = (),
    memory: int,
    seconds: float,
    name: str,
) -> Outcome:
    """Call a function in a child process.

    Parameters
    ----------
    function : str
        "package.module:function"; called with the arguments, it returns (JSON data, dict of name to array).
    arguments : sequence of JSON data
    imports : sequence of str
        Modules to import before the limits are set (their own needs do not count), besides that of the function.
    memory : int [bytes]
        Address space that the function may use beyond what the child holds when it starts.
    seconds : float
        Processor time; the wall clock may show four times as much and ten seconds more.
    name : str
        The file, for messages.

    Returns
    -------
    data : JSON data
    arrays : dict of str to ndarray
        Memory-mapped.

    Raises
    ------
    FormatError
        The parser crashed or refused the file.
    LimitError
        It needed more memory or time.
    """
    with tempfile.TemporaryDirectory(prefix="allanite-") as folder:
        job = {
            "function": function,
            "arguments": list(arguments),
            "imports": list(imports),
            "memory": memory,
            "seconds": seconds,
            "folder": folder,
        }
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(p for p in sys.path if p),
            "OMP_NUM_THREADS": "1",
        }
        environment["OPENBLAS_NUM_THREADS"] = "1"
        try:
            done = subprocess.run(
                [sys.executable, "-c", _CHILD],
                input=json.dumps(job).encode(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                timeout=4 * seconds + 10,
                env=environment,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise _too_slow(name, seconds) from None
        return _outcome(Path(folder), done, name, memory, seconds)


def _outcome(
    folder: Path, done: subprocess.CompletedProcess[bytes], name: str, memory: int, seconds: float
) -> Outcome:
    if done.returncode in (-getattr(signal, "SIGXCPU", 24), -getattr(signal, "SIGKILL", 9)):
        raise _too_slow(name, seconds)
    report = folder / "report.json"
    if done.returncode < 0 and any(words in done.stderr for words in _NO_MEMORY):
        raise _too_large(name, memory)
    if done.returncode != 0 or not report.exists():
        how = f"by signal {-done.returncode}" if done.returncode < 0 else f"with status {done.returncode}"
        raise FormatError(
            f"{name}: the parser died {how}: the file is damaged (this process was not affected)"
        )
    answer = json.loads(report.read_text(encoding="utf-8"))
    if "error" in answer:
        kind, message = answer["error"]
        if kind == "MemoryError":
            raise _too_large(name, memory)
        raise _ERRORS.get(kind, FormatError)(
            message if kind in _ERRORS else f"{name}: damaged or unsupported ({kind}: {message[:300]})"
        )
    arrays = {}
    for key, file in answer["arrays"].items():
        array = np.load(folder / file, mmap_mode=_MAPPED, allow_pickle=False)
        arrays[key] = array if array.size > 1 << 14 else np.array(array)
    return answer["data"], arrays


def _too_large(name: str, memory: int) -> LimitError:
    return LimitError(f"{name}: reading it needs more than {memory >> 20} MiB of memory: refused")


def _too_slow(name: str, seconds: float) -> LimitError:
    return LimitError(f"{name}: reading it took more than {seconds:g} s of processor time: stopped")


# -- in the child ------------------------------------------------------------------------------------------


def limit(memory: int, seconds: float) -> None:
    """Limit this process: address space beyond the present one, processor time, no core dumps.

    Without effect where the system has no such limits: see `allanite.plain_files.process_limits`.
    """
    status = Path("/proc/self/statm")
    present = int(status.read_text().split()[0]) * mmap.PAGESIZE if status.exists() else 1 << 31
    limit_memory(present + memory)
    limit_processor_time(max(round(seconds), 1), grace=2)


def _child() -> None:
    """Do the job that stands on standard input."""
    job = json.loads(sys.stdin.buffer.read())
    folder = Path(job["folder"])
    module, _, function = job["function"].partition(":")
    for needed in job["imports"]:
        import_module(needed)
    work = getattr(import_module(module), function)
    limit(job["memory"], job["seconds"])
    try:
        data, arrays = work(*job["arguments"])
        answer: dict[str, Any] = {"data": data, "arrays": {}}
        for i, (key, array) in enumerate(arrays.items()):
            np.save(folder / f"{i}.npy", array, allow_pickle=False)
            answer["arrays"][key] = f"{i}.npy"
    except MemoryError:
        answer = {"error": ["MemoryError", ""]}
    except Exception as error:  # noqa: BLE001  (whatever a parser raises is the report)
        answer = {"error": [type(error).__name__, str(error)]}
    (folder / "report.json").write_text(json.dumps(answer), encoding="utf-8")
