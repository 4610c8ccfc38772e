# SPDX-License-Identifier: BSD-3-Clause
"""What a comparison of records says, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["agreement_sentence", "difference_words", "others_words", "parameter_name"]


def parameter_name(symbol: str) -> str:
    """As it stands in a table.

    >>> parameter_name("T"), parameter_name("mean"), parameter_name("N")
    ('T_b', 'bias', 'N')
    """
    return {"T": "T_b", "mean": "bias"}.get(symbol, symbol)


def agreement_sentence(records: int, channels: int, p: float) -> str:
    """What was looked at, where nothing differs."""
    many = f"{channels} channels" if channels > 1 else "the curves and parameters"
    return f"{many} of {records} records agree within their intervals (p = {p:.2g})"


def others_words(*, agree: bool) -> str:
    """What the records beside an outlier do."""
    return "agree" if agree else "differ, too"


def difference_words(channel: str, symbols: Sequence[str], outlier: str, *, agree: bool) -> str:
    """In what a channel differs, and the record that stands out.

    >>> difference_words("x", ["N", "K"], "sn3", agree=True)
    'x in N, K; sn3 stands out, the others agree'
    """
    words = f"{channel} in {', '.join(symbols)}" if symbols else f"{channel} in its curve"
    return f"{words}; {outlier} stands out, the others {others_words(agree=agree)}" if outlier else words
