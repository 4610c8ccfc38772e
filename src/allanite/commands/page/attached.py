# SPDX-License-Identifier: BSD-3-Clause
"""Instruments that a request may choose: those that this machine lists, and those of the administrator's file.

A request holds the id of one of them. The name behind it (a port, a VISA resource, a URL of pyserial) never comes from
a request: such names can write files and reach other machines.
"""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Iterable, Mapping
from importlib import import_module
from typing import Any

from allanite.commands.page.children import Quick
from allanite.commands.page.replies import Refused
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.extras import require

__all__ = ["KINDS", "Attached", "Named", "listed_here"]

KINDS: Mapping[str, str] = {"serial": "port", "3458a": "resource"}
"""Kinds of instruments that are attached somewhere, and the option that says where."""

_FRESH = 2.0  # [s] a list is taken for current


@dataclass(frozen=True, slots=True, kw_only=True)
class Named:
    """An instrument under a name of the system.

    Attributes
    ----------
    kind : str
        Of `KINDS`.
    name : str
        Port or resource.
    title : str
        For people.
    format : str
        File that describes the frames of a serial device; "" where a request chooses one of the folder.
    """

    kind: str
    name: str
    title: str
    format: str = ""

    @property
    def id(self) -> str:
        """Short, and the same at each start."""
        facts = "\0".join((self.kind, self.name, self.format))
        return hashlib.sha256(facts.encode(errors="surrogateescape")).hexdigest()[:12]


class Attached:
    """The instruments of this machine, looked for by a child process: a driver that hangs or dies harms nothing.

    Parameters
    ----------
    named : iterable of Named
        Of the administrator's file.
    seconds : float [s]
        A look is given up after this time.
    """

    def __init__(self, named: Iterable[Named], seconds: float) -> None:
        self._named, self._seconds = tuple(named), seconds
        self._lock = threading.Lock()
        self._found: tuple[Named, ...] = ()
        self._note, self._looked = "", float("-inf")

    def look(self) -> tuple[tuple[Named, ...], str]:
        """All of them, those of the file first; and why some may be missing."""
        with self._lock:
            if time.monotonic() - self._looked > _FRESH:
                self._found, self._note = self._listed()
                self._looked = time.monotonic()
            return self._known(), self._note

    def get(self, kind: str, given: object) -> Named:
        """The instrument of a kind with this id.

        Raises
        ------
        Refused
            None has it.
        """
        for known in (self._known, lambda: self.look()[0]):
            for instrument in known():
                if (instrument.kind, instrument.id) == (kind, given):
                    return instrument
        raise Refused(404, f"{KINDS[kind]} must be the id of an attached instrument: reload the list")

    def _known(self) -> tuple[Named, ...]:
        taken = {(n.kind, n.name) for n in self._named}
        return (*self._named, *(n for n in self._found if (n.kind, n.name) not in taken))

    def _listed(self) -> tuple[tuple[Named, ...], str]:
        child = Quick(self._seconds)
        try:
            answer = child.ask({"task": "attached"})
        except Refused:
            return (), f"this machine did not list its instruments within {self._seconds:g} s"
        finally:
            child.close()
        if answer["exit"]:
            return (), f"this machine cannot list its instruments: {answer.get('message', '')}"
        result = answer["result"]
        return tuple(Named(**facts) for facts in result["instruments"]), "; ".join(result["notes"])


# -- in the child -----------------------------------------------------------------------------------------


def listed_here() -> dict[str, Any]:
    """Serial ports and VISA resources of this machine, found without asking the network."""
    instruments, notes = [], []
    for of in (_ports, _resources):
        try:
            instruments += of()
        except InputError as missing:
            notes.append(str(missing))
        except Exception as error:  # noqa: BLE001 - drivers of others; what they cannot list is said
            notes.append(f"{'serial ports' if of is _ports else 'VISA'}: {error}")
    return {"instruments": instruments, "notes": notes}


def _ports() -> list[dict[str, str]]:
    require("serial", "instruments", "the list of serial ports")
    from serial.tools.list_ports import comports

    return [
        {"kind": "serial", "name": p.device, "title": p.device if p.description in ("n/a", "", None, p.device)
         else f"{p.device}: {p.description}"}
        for p in sorted(comports())
    ]  # fmt: skip


def _resources() -> list[dict[str, str]]:
    """Instruments at GPIB and USB. Asked for more, VISA would look for others in the network."""
    require("pyvisa", "instruments", "the list of VISA resources")
    import pyvisa

    try:
        manager = pyvisa.ResourceManager()
    except (OSError, ValueError):  # neither a maker's library nor pyvisa-py
        return []
    if manager.visalib.library_path == "py":
        kinds = import_module("pyvisa_py.sessions").Session.iter_valid_session_classes()
        # Its list_resources() asks all kinds of sessions, and filters what they found.
        names = [
            name for (bus, _), kind in kinds
            if bus in (pyvisa.constants.InterfaceType.gpib, pyvisa.constants.InterfaceType.usb)
            for name in kind.list_resources()
        ]  # fmt: skip
    else:
        names = [name for bus in ("GPIB", "USB") for name in manager.list_resources(f"{bus}?*INSTR")]
    return [{"kind": "3458a", "name": str(name), "title": str(name)} for name in dict.fromkeys(names)]
