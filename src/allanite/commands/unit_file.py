# SPDX-License-Identifier: BSD-3-Clause
"""A unit of systemd that runs a recording as it was tried by hand: a week unattended.

The command of the unit is the one that was typed, without ``--unit-file``. What the unit promises: it starts again
after a failure and after a power cut, and never after a run that ended as planned or was stopped by hand. Such an end
leaves a file beside the runs; while that is there, the unit does not start.

References: systemd.service(5), systemd.exec(5), systemd.kill(5).
"""

from __future__ import annotations

import getpass
import os
import re
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from allanite.errors import InputError
from allanite.plain_files.atomic_file import fresh

__all__ = ["unit_text", "write_unit"]

_OPTION = "--unit-file"
_UNIT = """\
# Made by: {typed}
# To install:  sudo cp {name} /etc/systemd/system/ && sudo systemctl daemon-reload && sudo systemctl enable --now {name}
# To watch:    allanite monitor {out}        journalctl -u {name}
# To stop:     sudo systemctl stop {name}          the run is closed, with status "abort"
# To run once more: remove {done}

[Unit]
Description=allanite records {what}
Wants=time-sync.target
After=local-fs.target time-sync.target
# A run that is finished is not begun again, neither now nor at the next start of the machine.
ConditionPathExists=!{done_path}
# It is tried again as often as it fails, every half a minute: nobody is there to do it.
StartLimitIntervalSec=0

[Service]
Type=exec
User={user}
WorkingDirectory={folder}
Environment=PYTHONUNBUFFERED=1 NO_COLOR=1
ExecStart={command}
ExecStopPost=/bin/sh -c {mark}

# Exit codes: 0 nothing is missing, 3 finished with samples missing: both are ends. 2 is a wrong command.
# All else (1: no instrument or no disk; killed) begins another run in another folder after half a minute.
SuccessExitStatus=3
Restart=on-failure
RestartPreventExitStatus=2
RestartSec=30

# SIGINT closes the run as Ctrl-C does; the disk and the instrument get time for it.
KillSignal=SIGINT
KillMode=mixed
TimeoutStopSec=120

# Before others, but not at their cost: the recorder needs under a percent of one core.
Nice=-5
IOSchedulingClass=best-effort
IOSchedulingPriority=0
OOMScoreAdjust=-500
NoNewPrivileges=yes
ProtectSystem=full

StandardOutput=journal
StandardError=journal
SyslogIdentifier={label}

[Install]
WantedBy=multi-user.target
"""


def unit_text(
    words: Sequence[str],
    *,
    name: str,
    out: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    user: str,
    program: Sequence[str],
) -> str:
    """The unit.

    Parameters
    ----------
    words : sequence of str
        The command as it was typed, without the name of the program.
    name : str
        Of the unit: "gyro.service".
    out : path
        Folder of the runs.
    folder : path
        Where the command was typed: relative paths in it hold from there.
    user : str
        Who records.
    program : sequence of str
        What starts allanite, the first word an absolute path.

    Raises
    ------
    InputError
        A name that systemd does not take.
    """
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9:_.\-]*\.service", name):
        raise InputError(
            f"{name!r} is not a unit name: write e.g. gyro.service, of letters, digits and - _ . :"
        )
    kept = _without_option(words)
    place = Path(folder).absolute()
    done = place / out / f"{name.removesuffix('.service')}.done"
    mark = (
        'if [ "$SERVICE_RESULT" = success ] && [ "$(systemctl is-system-running)" != stopping ]; '
        f"then : > {shlex.quote(str(done))}; fi"
    )
    return _UNIT.format(
        typed=_line(shlex.join(["allanite", *words])),
        name=name,
        out=_line(str(place / out)),
        done=_line(str(done)),
        done_path=_specifiers(str(done)),
        what=_specifiers(_line(kept[1] if len(kept) > 1 else "an instrument")),
        user=user,
        folder=_specifiers(str(place)),
        command=" ".join(map(_quoted, [*program, *kept])),
        mark=_quoted(mark),
        label=name.removesuffix(".service"),
    )


def write_unit(path: str | os.PathLike[str], words: Sequence[str], out: str | os.PathLike[str]) -> Path:
    """Write the unit for the command that was typed here, for who typed it.

    Raises
    ------
    InputError
        A name that systemd does not take.
    StorageError
        The file exists, or the disk refuses.
    """
    target = Path(path)
    text = unit_text(
        words,
        name=target.name,
        out=out,
        folder=Path.cwd(),
        user=getpass.getuser(),
        program=(sys.executable, "-m", "allanite"),
    )
    with fresh(target, force=False) as place:
        place.write_text(text, encoding="utf-8")
    return target


def _without_option(words: Sequence[str]) -> list[str]:
    kept, skip = [], False
    for word in words:
        if skip or word.startswith(f"{_OPTION}="):
            skip = False
        elif word == _OPTION:
            skip = True
        else:
            kept.append(word)
    return kept


def _quoted(word: str) -> str:
    """A word of a command line of systemd: its own quotes, and neither its specifiers nor its variables."""
    if "\n" in word or "\r" in word:
        raise InputError(f"a unit cannot contain a line break: {word!r}")
    text = _specifiers(word).replace("$", "$$")
    if re.fullmatch(r"[A-Za-z0-9_./:=@%+,-]+", text):
        return text
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _specifiers(text: str) -> str:
    return _line(text).replace("%", "%%")


def _line(text: str) -> str:
    return text.replace("\n", " ").replace("\r", " ")
