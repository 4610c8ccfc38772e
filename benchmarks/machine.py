# SPDX-License-Identifier: BSD-3-Clause
"""What a result was measured on: enough to judge it, nothing that names a person or a place.

`load` is the load average over the last 15 minutes, the measurement included: above the number of threads of the
measurement the machine was busy with something else, and the numbers are worth less.
"""

from __future__ import annotations

import datetime
import json
import os
import platform
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parent / "results"


def describe(*packages: str) -> dict[str, Any]:
    """Date, processor, memory, load, Python, versions."""
    cpu = [line for line in _lines("/proc/cpuinfo") if line.startswith("model name")]
    memory = [line for line in _lines("/proc/meminfo") if line.startswith("MemTotal")]
    return {
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "processor": cpu[0].split(":", 1)[1].strip() if cpu else platform.machine(),
        "cores": os.cpu_count(),
        "memory_gib": round(int(memory[0].split()[1]) / 2**20) if memory else None,
        "system": f"{platform.system()} {platform.machine()}",
        "load": round(os.getloadavg()[2], 1),
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in ("allanite", "numpy", *packages)},
    }


def save(
    name: str, title: str, result: dict[str, Any], header: Sequence[str], rows: Sequence[Sequence[str]]
) -> str:
    """Write results/<name>.json and .md; the text of the latter is returned."""
    machine = ", ".join(f"{key} {value}" for key, value in result["machine"].items())
    table = [header, ["---"] * len(header), *rows]
    notes = [f"* {note}" for note in result.get("notes", [])]
    lines = [f"# {title}", "", machine, "", *("| " + " | ".join(row) + " |" for row in table), "", *notes]
    text = "\n".join(lines).rstrip() + "\n"
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / f"{name}.json").write_text(json.dumps(result, indent=1) + "\n")
    (RESULTS / f"{name}.md").write_text(text)
    return text


def _lines(path: str) -> list[str]:
    try:
        return Path(path).read_text().splitlines()
    except OSError:
        return []
