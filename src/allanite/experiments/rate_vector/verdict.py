# SPDX-License-Identifier: BSD-3-Clause
"""What a rate vector comes to: the codes of its checks, its remarks, and why a stretch was left out."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["LeftOut", "VectorCheckKind", "VectorRemark"]


class VectorCheckKind(StrEnum):
    """What is asked of the vectors."""

    SIZE = "size"
    POSES = "length in each pose"
    LATITUDE = "latitude"


class VectorRemark(StrEnum):
    """What is to be known or done, beside the checks that did not pass."""

    UNDISTURBED = "record longer, undisturbed"
    LONGER = "record longer"
    TURN = "turn the sensor"
    HALF_TURN = "turn by half a turn"
    POSES = "several poses"


class LeftOut(StrEnum):
    """Why a stretch was left out."""

    MOVING = "moving"
    BESIDE = "beside a disturbance"
    OFF = "mean is off"
    MISSING = "samples missing"
    SHORT = "too short"
    REST = "end of the record"
