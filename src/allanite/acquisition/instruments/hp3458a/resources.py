# SPDX-License-Identifier: BSD-3-Clause
"""How the place of a meter is written: VISA resources and Prologix-style adapters."""

from __future__ import annotations

import re
from pathlib import Path

from allanite.acquisition.instruments.port_names import refusal_of_path
from allanite.errors import InputError

__all__ = ["DEFAULT_PORT", "PROLOGIX", "SOCKET", "device_of", "refuse_unfit"]

PROLOGIX = re.compile(r"prologix://(?P<where>.+)/(?P<address>\d{1,2})", re.IGNORECASE)
SOCKET = re.compile(r"TCPIP\d*::(?P<host>.+)::(?P<port>\d+)::SOCKET", re.IGNORECASE)
#: The interfaces of VISA that a meter or a gateway to it may have. Behind others (PXI, VICP, PRLGX-ASRL) there is none.
_VISA = re.compile(
    r"(?:GPIB|TCPIP|USB)\d*::[!-~]+|ASRL(?P<port>\d+|/[!-~]+?)(?:::INSTR)?", re.IGNORECASE | re.ASCII
)
#: Port of an adapter in the network.
DEFAULT_PORT = 1234


def refuse_unfit(resource: str) -> None:
    """Raise if the text is no resource: to be found before anything is opened."""
    match = PROLOGIX.fullmatch(resource)
    if resource.lower().startswith("prologix:") and (not match or int(match["address"]) > 30):
        raise InputError(
            f"resource {resource!r}: write prologix://host:port/22 or prologix:///dev/ttyUSB0/22, "
            "where the last number is the GPIB address, 0 to 30"
        )
    visa = _VISA.fullmatch(resource)
    if not match and (not visa or "::" not in resource or "://" in resource):
        raise InputError(
            f"resource {resource!r} is neither a VISA resource (GPIB0::22::INSTR, TCPIP::host::port::SOCKET, USB0::…, "
            "ASRL/dev/ttyS0::INSTR) nor a prologix:// address"
        )
    # pyvisa-py hands the port of ASRL to pyserial as it is.
    path = match["where"] if match else (visa and visa["port"]) or ""
    if path.startswith("/") and (refusal := refusal_of_path(path)):
        raise InputError(refusal)


def device_of(resource: str) -> str:
    """What two programs must not use at a time, whatever way the resource is written.

    An adapter is one device, however many instruments are behind it: it talks to one address at a time. Names of a host
    are not looked up.

    Raises
    ------
    InputError
        The text is no resource.

    Examples
    --------
    >>> device_of("prologix://Lab-7/22"), device_of("TCPIP0::lab-7::1234::SOCKET"), device_of("gpib::22::instr")
    ('tcp://lab-7:1234', 'tcp://lab-7:1234', 'GPIB0::22::INSTR')
    """
    refuse_unfit(resource)
    if match := PROLOGIX.fullmatch(resource):
        where = match["where"]
        if where.startswith("/"):
            return str(Path(where).resolve())
        host, _, port = where.partition(":")
        return f"tcp://{host.lower()}:{port or DEFAULT_PORT}"
    if match := SOCKET.fullmatch(resource):
        return f"tcp://{match['host'].lower()}:{match['port']}"
    kind, *rest = resource.upper().split("::")
    board = kind if kind[-1:].isdigit() else f"{kind}0"
    return "::".join([board, *rest, *([] if rest and rest[-1] in ("INSTR", "SOCKET") else ["INSTR"])])
