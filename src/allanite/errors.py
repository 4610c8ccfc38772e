# SPDX-License-Identifier: BSD-3-Clause
"""One tree of errors. A message says what is wrong, where, and what to do next.

The library raises; only the command line catches `AllaniteError` and turns it into an exit code.
A refusal that is a result ("not resolved, record 6 h more") is a return value, never an exception.
"""

from __future__ import annotations

__all__ = [
    "AllaniteError",
    "DataQualityError",
    "DataQualityWarning",
    "FitError",
    "FormatError",
    "InputError",
    "InstrumentError",
    "LimitError",
    "StorageError",
    "WorkerError",
]


class AllaniteError(Exception):
    """Base of every error that allanite raises on purpose."""


class InputError(AllaniteError, ValueError):
    """A bad argument: type, shape, unit, rate or lag."""


class DataQualityError(AllaniteError):
    """Data that cannot support the request.

    Attributes
    ----------
    findings : tuple
        The `allanite.recording.health.Finding` objects behind the refusal; empty when the refusal has another cause.
    """

    def __init__(self, message: str, findings: tuple[object, ...] = ()) -> None:
        super().__init__(message)
        self.findings = findings


class FormatError(AllaniteError):
    """A file that breaks its format, or uses a feature of it that allanite forbids."""


class LimitError(AllaniteError):
    """A limit of size, time or memory was met before harm was done."""


class StorageError(AllaniteError):
    """The disk: full, short write, failed sync, or a file that must not be overwritten."""


class InstrumentError(AllaniteError):
    """The instrument: silence, garbage, or the wrong identity."""


class WorkerError(AllaniteError):
    """The workers of a fleet: none is there, one was lost, or has another version of allanite."""


class FitError(AllaniteError):
    """The fit did not converge or the model is not identifiable.

    Attributes
    ----------
    partial : object or None
        Result so far, for a caller that can still use it.
    """

    def __init__(self, message: str, partial: object | None = None) -> None:
        super().__init__(message)
        self.partial = partial


class DataQualityWarning(UserWarning):
    """The result is given, with the same caveat in machine-readable form."""
