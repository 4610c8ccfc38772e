# SPDX-License-Identifier: BSD-3-Clause
"""The `write` of a module whose format is a template: the lines that it makes of the numbers, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar, Unpack

from allanite.exporters.imu.numbers import ImuNumbers
from allanite.exporters.imu.options import NoiseOptions
from allanite.exporters.imu.preamble import Consumer

__all__ = ["Write", "writer"]

Json = Mapping[str, Any]
Numbers = TypeVar("Numbers", bound=ImuNumbers)
Read = TypeVar("Read", bound=ImuNumbers, covariant=True)


class Write(Protocol):
    """`write` of a format without options of its own."""

    def __call__(self, document: Json, **options: Unpack[NoiseOptions]) -> str:
        """The text of the file."""
        ...


class ModelReader(Protocol[Read]):
    """`white_and_walk` or `gauss_markov_imu`."""

    def __call__(self, document: Json, consumer: Consumer, **options: Unpack[NoiseOptions]) -> Read:
        """The numbers of a study."""
        ...


def writer(template: Callable[[Numbers], list[str]], read: ModelReader[Numbers], consumer: Consumer) -> Write:
    """A function that reads the numbers of a study and writes them by a template, the lines of the file."""

    def write(document: Json, **options: Unpack[NoiseOptions]) -> str:
        """The text of the file for a study.

        Parameters
        ----------
        document : dict
            A study document.
        **options
            `NoiseOptions`.

        Raises
        ------
        InputError
            What `white_and_walk` or `gauss_markov_imu` refuses, whichever the consumer takes its numbers from, or
            several correlation times where the file has one.
        """
        return "\n".join(template(read(document, consumer, **options))) + "\n"

    return write
