# SPDX-License-Identifier: BSD-3-Clause
"""What becomes of many damaged files: each is read in a process of its own, with the limits of a reader's child.

A reader starts a fresh interpreter for every file, which costs a third of a second. Here one interpreter imports all,
and forks for every file: in the fork the child's part runs with its limits, then the parent's part. A signal in the
fork is what the real reader reports as a FormatError.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from allanite.errors import FormatError, InputError, LimitError

__all__ = ["CODES", "inline", "mutations", "outcomes", "tally"]

CODES = {10: "read", 11: "refused", 12: "another error"}
_PATCHED = ("ardupilot", "ulog", "tdms", "hdf5", "matlab", "rosbag", "spreadsheet")
_HARNESS = """
import json, os, signal, sys, traceback
from importlib import import_module
job = json.load(sys.stdin)
sys.path.insert(0, job["folder"])
from hostile_files import inline
from allanite.errors import AllaniteError
from allanite.readers import read
from allanite.readers.sandbox import limit
for name in job["patched"]:
    import_module("allanite.readers." + name).run = inline
read(job["sound"], **job["options"])  # everything is imported before the first fork
found = []
for path in job["paths"]:
    child = os.fork()
    if child == 0:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        signal.alarm(job["seconds"])
        limit(512 << 20, job["seconds"])
        code = 10
        try:
            recording = read(path, **job["options"])
            for name in recording.names:
                recording.values(name)
        except AllaniteError:
            code = 11
        except BaseException:
            traceback.print_exc()
            code = 12
        os._exit(code)
    status = os.waitpid(child, 0)[1]
    found.append(-os.WTERMSIG(status) if os.WIFSIGNALED(status) else os.WEXITSTATUS(status))
print(json.dumps(found))
"""


def inline(function: str, arguments: Sequence[str], **limits: Any) -> tuple[Any, dict[str, Any]]:
    """`allanite.readers.sandbox.run` without the process: the same function, its errors classified as there."""
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


def outcomes(
    sound: Path, paths: Sequence[Path], options: dict[str, Any] | None = None, *, seconds: int = 10
) -> list[int]:
    """Exit code of every file (see `CODES`), or less the number of the signal that ended its process.

    `sound` is a file of the same format that can be read: it is read once in the process that is forked.
    """
    job = {
        "folder": str(Path(__file__).parent),
        "sound": str(sound),
        "patched": _PATCHED,
        "paths": [str(p) for p in paths],
        "options": options or {},
        "seconds": seconds,
    }
    done = subprocess.run(
        [sys.executable, "-c", _HARNESS], input=json.dumps(job), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found: list[int] = json.loads(done.stdout)
    assert 12 not in found, done.stderr[-3000:]
    return found


def tally(found: Sequence[int]) -> dict[str, int]:
    """How many files came to what."""
    return dict(Counter(CODES.get(code, f"signal {-code}") for code in found))
