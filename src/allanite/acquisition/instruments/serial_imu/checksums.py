# SPDX-License-Identifier: BSD-3-Clause
"""Checksums of frames and lines: bytes in, a number out.

``sum8``          sum of the bytes modulo 256
``xor``           all bytes joined by exclusive or; NMEA 0183 writes it in hexadecimal after a ``*``
``crc8``          polynomial 0x07, begins with 0 ("CRC-8/SMBUS")
``crc16-ccitt``   polynomial 0x1021, begins with 0xFFFF ("CRC-16/IBM-3740"); with init 0 it is "CRC-16/XMODEM"
``crc32``         the one of Ethernet and zip ("CRC-32/ISO-HDLC")
``fletcher16``    sum and sum of sums; modulo 255, or modulo 256 as some receivers of satellite navigation do

Notes
-----
1. A fletcher16 counts as sum + 256 times the sum of sums: written little-endian the plain sum comes first.
2. With an error of the line of any kind, a checksum of b bits lets one of 2^b damaged frames through.

References
----------
.. [1] J. G. Fletcher, "An arithmetic checksum for serial transmissions", IEEE Trans. Commun. 30 (1982) 247.
.. [2] R. N. Williams, "A painless guide to CRC error detection algorithms" (1993): names of the parameters.
"""

from __future__ import annotations

import binascii
import functools
import operator
import zlib
from collections.abc import Callable
from itertools import accumulate
from typing import Literal, get_args

__all__ = ["KINDS", "SIZES", "ChecksumKind", "Computed", "checksum"]

ChecksumKind = Literal["sum8", "xor", "crc8", "crc16-ccitt", "crc32", "fletcher16"]
KINDS: tuple[str, ...] = get_args(ChecksumKind)
#: Bytes that a checksum takes.
SIZES: dict[str, int] = {"sum8": 1, "xor": 1, "crc8": 1, "crc16-ccitt": 2, "crc32": 4, "fletcher16": 2}

Computed = Callable[[bytes], int]

_CCITT, _CRC8 = 0x1021, 0x07


def checksum(
    kind: ChecksumKind,
    *,
    init: int | None = None,
    poly: int | None = None,
    reflected: bool = False,
    xor_out: int = 0,
    modulus: int = 255,
    negated: bool = False,
) -> Computed:
    """The function of one kind of checksum.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    init, poly, reflected, xor_out
        Of crc8 and crc16-ccitt; others have none. `reflected` takes bits from the lowest on.
    modulus : int
        Of fletcher16: 255 or 256.
    negated : bool
        Of sum8: the number that makes the sum of all bytes zero.

    Examples
    --------
    >>> [hex(checksum(kind)(b"123456789")) for kind in ("crc8", "crc16-ccitt", "crc32")]
    ['0xf4', '0x29b1', '0xcbf43926']
    """
    if kind == "sum8":
        return (lambda body: -sum(body) & 0xFF) if negated else (lambda body: sum(body) & 0xFF)
    if kind == "xor":
        return lambda body: functools.reduce(operator.xor, body, 0)
    if kind == "crc32":
        return zlib.crc32
    if kind == "fletcher16":
        return lambda body: sum(body) % modulus | sum(accumulate(body)) % modulus << 8
    if kind == "crc8":
        return _crc(8, _CRC8 if poly is None else poly, init or 0, reflected, xor_out)
    start = 0xFFFF if init is None else init
    if poly in (None, _CCITT) and not reflected:
        return lambda body: binascii.crc_hqx(body, start) ^ xor_out
    return _crc(16, _CCITT if poly is None else poly, start, reflected, xor_out)


def _crc(bits: int, poly: int, init: int, reflected: bool, xor_out: int) -> Computed:
    """A cyclic redundancy check by table, one byte at a time."""
    mask = (1 << bits) - 1
    if reflected:
        table = _reflected_table(int(f"{poly:0{bits}b}"[::-1], 2))
        begin = int(f"{init:0{bits}b}"[::-1], 2)

        def low_first(body: bytes) -> int:
            value = begin
            for byte in body:
                value = value >> 8 ^ table[(value ^ byte) & 0xFF]
            return value ^ xor_out

        return low_first
    table = _table(bits, poly)

    def high_first(body: bytes) -> int:
        value = init
        for byte in body:
            value = (value << 8 & mask) ^ table[(value >> bits - 8 ^ byte) & 0xFF]
        return value ^ xor_out

    return high_first


def _table(bits: int, poly: int) -> tuple[int, ...]:
    mask, top = (1 << bits) - 1, 1 << bits - 1
    table = []
    for byte in range(256):
        value = byte << bits - 8
        for _ in range(8):
            value = (value << 1 ^ (poly if value & top else 0)) & mask
        table.append(value)
    return tuple(table)


def _reflected_table(poly: int) -> tuple[int, ...]:
    table = []
    for byte in range(256):
        value = byte
        for _ in range(8):
            value = value >> 1 ^ (poly if value & 1 else 0)
        table.append(value)
    return tuple(table)
