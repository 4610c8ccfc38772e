# SPDX-License-Identifier: BSD-3-Clause
"""What a MATLAB file holds and is not read: objects, cells, arrays of structures, complex numbers.

One line of MATLAB writes each as something that is read.
"""

from __future__ import annotations

from collections.abc import Mapping

from allanite.plain_files.printable import printable

__all__ = ["CELL", "COMPLEX", "STRUCTURES", "said_of_objects"]

#: Names of what is no class of objects; no class of MATLAB has a space in its name.
CELL, STRUCTURES, COMPLEX = "a cell array", "an array of structures", "an array of complex numbers"

_LINES = {
    "timetable": "writetimetable({0}, 'log.csv')",
    "table": "writetable({0}, 'log.csv')",
    "timeseries": "writematrix([{0}.Time, {0}.Data], 'log.csv')",
    "iddata": "writematrix([{0}.SamplingInstants, {0}.OutputData], 'log.csv')",
    "Simulink.SimulationData.Dataset": "writematrix([{0}{{1}}.Values.Time, {0}{{1}}.Values.Data], 'log.csv')",
    "datetime": "t = seconds({0} - {0}(1)); save('log.mat', 't', '-append', '-v7')",
    "duration": "t = seconds({0}); save('log.mat', 't', '-append', '-v7')",
}
_SAVED = "save('log.mat', 'x', '-append')"
_PLAIN_LINES = {
    CELL: f"x = {{0}}{{{{1}}}}; {_SAVED}",
    STRUCTURES: f"x = {{0}}(1); {_SAVED}",
    COMPLEX: f"x = [real({{0}}(:)), imag({{0}}(:))]; {_SAVED}",
}
_OTHER = "x = double({0}); save('log.mat', 'x', '-v7')"


def said_of_objects(objects: Mapping[str, str]) -> dict[str, str]:
    """What is said of each object: its class, and the line of MATLAB that writes what allanite reads.

    Parameters
    ----------
    objects : mapping of name to class
    """
    return {name: _said(printable(name) or "x", kind) for name, kind in objects.items()}


def _said(name: str, kind: str) -> str:
    if kind in _PLAIN_LINES:
        line = _PLAIN_LINES[kind].format(name)
        return f"is {kind}; in MATLAB, save what is needed of it as a plain array: {line}"
    line = _LINES.get(kind, _OTHER).format(name)
    return f"is a {printable(kind)}, an object of MATLAB that cannot be read; in MATLAB: {line}"
