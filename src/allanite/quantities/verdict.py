# SPDX-License-Identifier: BSD-3-Clause
"""What a result comes to: a code for programs and documents, words and a tone for people."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["Tone", "Verdict", "WordedCode"]


class Tone(StrEnum):
    """How a verdict looks."""

    GOOD = "good"
    WARNING = "warning"
    FATAL = "fatal"


class Verdict(StrEnum):
    """Base of the verdicts of an analysis: ``MEMBER = code, words, tone``, the worst first.

    A member is its code; documents hold that, and code compares members, never words.

    Attributes
    ----------
    words : str
        Of which a sentence begins.
    tone : Tone
    """

    words: str
    tone: Tone

    def __new__(cls, code: str, words: str, tone: Tone) -> Verdict:
        member = str.__new__(cls, code)
        member._value_ = code
        member.words, member.tone = words, tone
        return member


class WordedCode(StrEnum):
    """Base of what a part of an analysis comes to: ``MEMBER = code, words``.

    Attributes
    ----------
    words : str
        A sentence, or the part of one.
    """

    words: str

    def __new__(cls, code: str, words: str) -> WordedCode:
        member = str.__new__(cls, code)
        member._value_ = code
        member.words = words
        return member
