# SPDX-License-Identifier: BSD-3-Clause
"""What every door of the package in a folder says of the toy analysis, as JSON: python doors.py PACKAGE FOLDER."""

from __future__ import annotations

import contextlib
import io
import json
import sys
from pathlib import Path


def typed(*words: str) -> str:
    """What a command prints."""
    from allanite.commands.cli import main

    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.suppress(SystemExit):
        main([*words])
    return out.getvalue()


def doors(folder: Path) -> dict[str, object]:
    """By the name of the door."""
    import allanite as al
    from allanite.commands import measure
    from allanite.commands.page.kinds import described_kinds
    from allanite.quantities.result import entries_of
    from allanite.views.registry import VIEWS, document_of
    from allanite.views.report import render_file

    log, out = str(folder / "log.csv"), folder / "out"
    toy = al.read(folder / "toy.dat", rate=100.0, unit="rad/s")
    model = al.NoiseModel.of(al.White(N=1e-4))
    terminal = typed("spread", log, "--rate", "100", "--trim", "0.1", "--out", str(out))
    document = json.loads((out / "spread.json").read_text(encoding="utf-8"))
    measured = measure("spread", log, rate=100.0, trim=0.1)
    remade = document_of(document)
    kinds = [type(measured.result), type(measured.result.channels[0])]
    again = render_file(out / "spread.json", out / "again.html")
    return {
        "commands": typed("--help"),
        "help": typed("spread", "--help"),
        "terminal": terminal,
        "document": document,
        "printed": json.loads(typed("spread", log, "--rate", "100", "--trim", "0.1", "--json")),
        "table": (out / "spread.csv").read_text(encoding="utf-8"),
        "report": (out / "report.html").read_text(encoding="utf-8"),
        "report of the file": again.read_text(encoding="utf-8"),
        "page": described_kinds()["spread"],
        "reference": {
            kind.__name__: [[e.name, e.unit, e.meaning] for e in entries_of(kind)] for kind in kinds
        },
        "formats": [*VIEWS],
        "python": measured.result.to_json(),
        "toy file": [toy.history[0].get("format"), [toy.n_samples, len(toy.channels)]],
        "consumers": typed("export", "--list"),
        "exported": al.export("toy", {"gyro": model}, rate=100.0, greeting="good day"),
        "read again": remade.result == measured.result,
    }


if __name__ == "__main__":
    # An editable install finds its own tree before all paths.
    sys.meta_path[:] = [f for f in sys.meta_path if type(f).__name__ != "ScikitBuildRedirectingFinder"]
    sys.path.insert(0, sys.argv[1])
    print(json.dumps(doors(Path(sys.argv[2]))))
