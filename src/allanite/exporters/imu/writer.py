# SPDX-License-Identifier: BSD-3-Clause
"""The `write` of a module whose format is a template: the lines that it makes of the numbers, and nothing else."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Protocol, TypeVar, Unpack

from allanite.errors import InputError
from allanite.exporters.imu.numbers import ImuNumbers
from allanite.exporters.imu.options import NoiseOptions, WhiteOptions
from allanite.exporters.imu.preamble import Consumer, rate_text
from allanite.exporters.imu.white import WhiteImu, white_imu

__all__ = ["SampleWrite", "WhiteWrite", "Write", "sample_writer", "white_writer", "writer"]

Json = Mapping[str, Any]
Numbers = TypeVar("Numbers", bound=ImuNumbers)
Read = TypeVar("Read", bound=ImuNumbers, covariant=True)


class Write(Protocol):
    """`write` of a format without options of its own."""

    def __call__(self, document: Json, **options: Unpack[NoiseOptions]) -> str:
        """The text of the file."""
        ...


class SampleWrite(Protocol):
    """`write` of a format whose numbers are those of one sample."""

    def __call__(
        self, document: Json, *, filter_rate: float | None = None, **options: Unpack[NoiseOptions]
    ) -> str:
        """The text of the file."""
        ...


class WhiteWrite(Protocol):
    """The same of white noise alone."""

    def __call__(
        self, document: Json, *, filter_rate: float | None = None, **options: Unpack[WhiteOptions]
    ) -> str:
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


def sample_writer(
    template: Callable[[Numbers, float], list[str]], read: ModelReader[Numbers], consumer: Consumer
) -> SampleWrite:
    """The same for a file whose numbers are those of one sample: the template takes their rate as well."""

    def write(document: Json, *, filter_rate: float | None = None, **options: Unpack[NoiseOptions]) -> str:
        """The text of the file for a study.

        Parameters
        ----------
        document : dict
            A study document.
        filter_rate : float, optional [Hz]
            Rate of the samples that the program gets or makes; that of the study by default.
        **options
            `NoiseOptions`.

        Raises
        ------
        InputError
            A rate that is not a positive number, or what the reader of the numbers refuses.
        """
        rate = _stream_rate(document, filter_rate)
        return "\n".join(template(read(document, _discrete(consumer, rate), **options), rate)) + "\n"

    return write


def white_writer(template: Callable[[WhiteImu, float], list[str]], consumer: Consumer) -> WhiteWrite:
    """The same for white noise alone, which has no walk and no correlation time."""

    def write(document: Json, *, filter_rate: float | None = None, **options: Unpack[WhiteOptions]) -> str:
        """The text of the file for a study.

        Parameters
        ----------
        document : dict
            A study document.
        filter_rate : float, optional [Hz]
            Rate of the samples that the program gets or makes; that of the study by default.
        **options
            `WhiteOptions`.

        Raises
        ------
        InputError
            A rate that is not a positive number, or what `white_imu` refuses.
        """
        rate = _stream_rate(document, filter_rate)
        return "\n".join(template(white_imu(document, _discrete(consumer, rate), **options), rate)) + "\n"

    return write


def _discrete(consumer: Consumer, rate: float) -> Consumer:
    """With the rate at the head of its conventions."""
    of_a_sample = f"DISCRETE: numbers of one sample at {rate_text(rate)} Hz; for another rate export again"
    return replace(consumer, convention=(of_a_sample, *consumer.convention))


def _stream_rate(document: Json, filter_rate: float | None) -> float:
    """The rate of samples that is asked for, or that of the study [Hz].

    Raises
    ------
    InputError
        Not a positive number.
    """
    rate = document["recording"]["rate"] if filter_rate is None else filter_rate
    if not (math.isfinite(rate) and rate > 0):
        raise InputError(f"filter_rate must be a positive number of samples per second, not {rate!r}")
    return float(rate)
