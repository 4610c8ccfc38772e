# SPDX-License-Identifier: BSD-3-Clause
"""What a user can ask for, and the doors at which it is asked.

The modules here do the work of a command each and hand over plain documents, tables and files; they can be called
without any door, and the page shows the lines that do.

`declaration`  a command said once: command line, form, job and Python lines come of it; `registry` lists them
`fleet`        many logs, and one table
`cli`          the command line
`page`         the page that `allanite serve` opens
`monitor`      a run while it grows

A declaration lies in the module that has the name of its command (`align`, `spectrum`); where the work needs more than
one function of the library, `work` in it names the module that does it (`alignment`, `spectra`).

Names below load on first use, as those of `allanite` do.
"""

_HOMES = {
    "describe": "recordings",
    "export_of": "exporting",
    "fit_file": "curves",
    "measure": "registry",
    "read_part": "recordings",
    "write_measurement": "measurement",
    "write_results": "study",
}
"""Name in the lines that the page shows -> the module that it lives in."""


def __getattr__(name: str) -> object:
    """Import a name from its module on first use (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'allanite.commands' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
