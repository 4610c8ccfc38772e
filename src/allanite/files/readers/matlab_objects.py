# SPDX-License-Identifier: BSD-3-Clause
"""Objects of MATLAB classes: their content is not documented, but one line of MATLAB writes it as a table."""

from __future__ import annotations

from collections.abc import Mapping

from allanite.plain_files.printable import printable

__all__ = ["said_of_objects"]

_LINES = {
    "timetable": "writetimetable({0}, 'log.csv')",
    "table": "writetable({0}, 'log.csv')",
    "timeseries": "writematrix([{0}.Time, {0}.Data], 'log.csv')",
    "iddata": "writematrix([{0}.SamplingInstants, {0}.OutputData], 'log.csv')",
    "Simulink.SimulationData.Dataset": "writematrix([{0}{{1}}.Values.Time, {0}{{1}}.Values.Data], 'log.csv')",
    "datetime": "t = seconds({0} - {0}(1)); save('log.mat', 't', '-append', '-v7')",
    "duration": "t = seconds({0}); save('log.mat', 't', '-append', '-v7')",
}
_OTHER = "x = double({0}); save('log.mat', 'x', '-v7')"


def said_of_objects(objects: Mapping[str, str]) -> dict[str, str]:
    """What is said of each object: its class, and the line of MATLAB that writes what allanite reads.

    Parameters
    ----------
    objects : mapping of name to class
    """
    return {
        name: f"is a {printable(kind)}, an object of MATLAB that cannot be read; in MATLAB: "
        + _LINES.get(kind, _OTHER).format(printable(name) or "x")
        for name, kind in objects.items()
    }
