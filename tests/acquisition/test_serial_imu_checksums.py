# SPDX-License-Identifier: BSD-3-Clause
"""Checksums of serial frames against published check values."""

from __future__ import annotations

from typing import Any

import pytest

from allanite.acquisition.instruments.serial_imu.checksums import checksum


@pytest.mark.parametrize(
    ("kind", "options", "wanted"),
    [
        ("crc8", {}, 0xF4),  # check values of the catalogue of CRC algorithms, for "123456789"
        ("crc8", {"poly": 0x31, "reflected": True}, 0xA1),  # MAXIM-DOW
        ("crc8", {"poly": 0x07, "init": 0, "xor_out": 0x55}, 0xA1),  # I-432-1
        ("crc16-ccitt", {}, 0x29B1),
        ("crc16-ccitt", {"init": 0}, 0x31C3),  # XMODEM
        ("crc16-ccitt", {"init": 0, "reflected": True}, 0x2189),  # KERMIT
        ("crc16-ccitt", {"init": 0xFFFF, "reflected": True, "xor_out": 0xFFFF}, 0x906E),
        ("crc16-ccitt", {"init": 0, "poly": 0x8005}, 0xFEE8),  # UMTS
        ("crc32", {}, 0xCBF43926),
        ("sum8", {}, sum(b"123456789") % 256),
        ("sum8", {"negated": True}, -sum(b"123456789") % 256),
        ("xor", {}, 0x31),
        ("fletcher16", {}, 0x1EDE),
        ("fletcher16", {"modulus": 256}, 0x15DD),  # sums by hand: 477, 2325
    ],
)
def test_checksums_of_the_check_word(kind: Any, options: dict[str, Any], wanted: int) -> None:
    assert checksum(kind, **options)(b"123456789") == wanted


def test_fletcher_of_the_textbook() -> None:
    found = [checksum("fletcher16")(word) for word in (b"abcde", b"abcdef", b"abcdefgh")]
    assert found == [0xC8F0, 0x2057, 0x0627]
