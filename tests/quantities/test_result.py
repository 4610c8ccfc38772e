# SPDX-License-Identifier: BSD-3-Clause
"""Results out of their dataclass: documents there and back, what a damaged one says, and what is said of fields."""

from __future__ import annotations

import importlib
import json
import math
import pkgutil
import typing
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import allanite
from allanite.errors import FormatError
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.quantities.result import Result, entries_of

SCALARS = st.floats(allow_nan=False, allow_infinity=False)


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True, slots=True, kw_only=True)
class Part(Result):
    """A part.

    Attributes
    ----------
    size : float [m]
        How large.
    colours : tuple of Colour
        Which.
    """

    size: float
    colours: tuple[Colour, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Toy(Result):
    """A result with a field of every kind."""

    FORMAT: ClassVar[str] = "allanite-toy"
    STATED: ClassVar[tuple[str, ...]] = ("doubled",)

    parts: tuple[Part, ...]
    values: NDArray[np.float64]
    flags: NDArray[np.bool_]
    pair: tuple[float, int]
    by_name: Mapping[str, float]
    perhaps: float | None
    good: bool
    words: str = ""

    @property
    def doubled(self) -> float:
        return 2.0 * sum(p.size for p in self.parts)


def toys() -> st.SearchStrategy[Toy]:
    parts = st.builds(Part, size=SCALARS, colours=st.lists(st.sampled_from(Colour)).map(tuple))
    return st.builds(
        Toy,
        parts=st.lists(parts, max_size=3).map(tuple),
        values=st.lists(SCALARS).map(lambda v: np.array(v, dtype=np.float64)),
        flags=st.lists(st.booleans()).map(lambda v: np.array(v, dtype=np.bool_)),
        pair=st.tuples(SCALARS, st.integers()),
        by_name=st.dictionaries(st.text(), SCALARS, max_size=3),
        perhaps=st.none() | SCALARS,
        good=st.booleans(),
        words=st.text(),
    )


@given(toys())
def test_a_result_comes_back_from_its_document(toy: Toy) -> None:
    document = json.loads(json.dumps(toy.to_json(), allow_nan=False))
    again = Toy.from_json(document)
    assert again.to_json() == document
    assert again.parts == toy.parts and again.pair == toy.pair and again.perhaps == toy.perhaps
    assert again.values.dtype == np.float64 and again.flags.dtype == np.bool_


def test_numbers_that_do_not_exist_are_null_and_not_a_number() -> None:
    part = Part(size=math.inf)
    assert part.to_json() == {"size": None, "colours": []}
    assert math.isnan(Part.from_json(part.to_json()).size)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"parts": [{"size": 1.0}, {"size": "large"}]},
            r"allanite-toy\.parts\[1\]\.size: a float is expected, not 'large'",
        ),
        ({"parts": [{}]}, r"allanite-toy\.parts\[0\]\.size is missing"),
        (
            {"parts": [{"size": 1.0, "colours": ["green"]}]},
            r"colours\[0\]: one of 'red', 'blue' is expected, not 'green'",
        ),
        ({"parts": [3]}, r"parts\[0\]: an object is expected, not 3"),
        ({"values": ["x"]}, r"values: a list of numbers is expected"),
        ({"pair": [1.0]}, r"pair: 2 members are expected, not 1"),
        ({"by_name": [1.0]}, r"by_name: an object is expected"),
        ({"by_name": {"x": True}}, r"by_name\.x: a float is expected, not True"),
        ({"good": 1}, r"good: a bool is expected, not 1"),
        ({"version": 2}, r"version 2 of allanite-toy; this allanite reads up to version 1"),
    ],
)
def test_a_damaged_document_says_where(change: dict[str, Any], words: str) -> None:
    none = np.zeros(0)
    toy = Toy(parts=(), values=none, flags=none > 0, pair=(1.0, 2), by_name={}, perhaps=None, good=True)
    with pytest.raises(FormatError, match=words):
        Toy.from_json({**toy.to_json(), **change})


def test_a_quantity_says_its_interval_or_that_it_is_not_resolved() -> None:
    assert str(Quantity.of(2.0, (1.5, 2.5), "m/s²")) == "2.00 [1.50, 2.50] m/s²"
    unknown = Quantity.of(2.0, (0.0, math.inf), "1")
    assert unknown.status is QuantityStatus.NOT_RESOLVED and str(unknown) == "2.00 (not resolved)"


def results() -> list[type[Result]]:
    """Every result of the package."""
    for module in pkgutil.walk_packages(allanite.__path__, "allanite."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    found, queue = [], [Result]
    while queue:
        for kind in queue.pop().__subclasses__():
            queue.append(kind)
            found += [kind] if kind.__module__.startswith("allanite") and kind not in found else []
    return found


def test_the_docstring_of_a_result_says_what_each_field_is() -> None:
    """Its reference is made from there: a field without a meaning, or a number of SI without its unit, is not said."""
    for kind in results():
        entries = {e.name: e for e in entries_of(kind)}
        own = (
            {f.name for f in fields(kind)}
            - {  # type: ignore[arg-type]
                name for base in kind.__mro__[1:] for name in getattr(base, "__dataclass_fields__", ())
            }
        )
        assert own <= set(entries), f"{kind.__name__}: {sorted(own - set(entries))}"
        assert set(entries) <= {*typing.get_type_hints(kind), *kind.STATED}, kind.__name__
        assert not [e.name for e in entries.values() if not e.meaning], kind.__name__
