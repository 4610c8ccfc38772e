# SPDX-License-Identifier: BSD-3-Clause
"""`allanite.lazy_dataclasses`: the same classes as those of the standard library, without compiling at import."""

from __future__ import annotations

import builtins
import copy
import dataclasses
import inspect
import itertools
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field
from functools import partial
from operator import eq
from typing import Any, ClassVar

import pytest

from allanite import lazy_dataclasses

Decorator = Callable[..., Callable[[type[Any]], type[Any]]]
STANDARD: Decorator = dataclasses.dataclass
OURS: Decorator = lazy_dataclasses.dataclass
OPTIONS = [
    dict(zip(("eq", "frozen", "slots", "kw_only"), values, strict=True))
    for values in itertools.product((True, False), repeat=4)
]


def empty(dataclass: Decorator, options: dict[str, bool]) -> type[Any]:
    @dataclass(**options)
    class Subject:
        """Nothing."""

    return Subject


def single(dataclass: Decorator, options: dict[str, bool]) -> type[Any]:
    @dataclass(**options)
    class Subject:
        """One value."""

        value: float = 1.5

    return Subject


def mixed(dataclass: Decorator, options: dict[str, bool]) -> type[Any]:
    @dataclass(**options)
    class Subject:
        """Every kind of field."""

        NAME: ClassVar[str] = "of the class"
        first: float
        second: str = "two"
        many: list[int] = field(default_factory=list)
        quiet: int = field(default=3, repr=False)
        beside: int = field(default=4, compare=False)
        unhashed: tuple[int, ...] = field(default=(), hash=False)
        named: int = field(default=5, kw_only=True)
        fixed: int = field(default=6, init=False)
        made: tuple[int, ...] = field(default_factory=lambda: (7,), init=False)
        doubled: float = field(init=False)

        def __post_init__(self) -> None:
            object.__setattr__(self, "doubled", 2 * self.first)

    return Subject


def inherited(dataclass: Decorator, options: dict[str, bool]) -> type[Any]:
    @dataclass(**options)
    class Base:
        """The first fields."""

        first: float
        second: str = "two"

    @dataclass(**options)
    class Subject(Base):
        """One changed, one more."""

        second: str = "other"
        third: int = 3

    return Subject


def own_methods(dataclass: Decorator, options: dict[str, bool]) -> type[Any]:
    @dataclass(**options)
    class Subject:
        """Methods that stay as they are."""

        first: float

        def __init__(self, first: float) -> None:
            object.__setattr__(self, "first", first + 1)

        def __repr__(self) -> str:
            return f"mine {self.first}"

        def __eq__(self, other: object) -> bool:
            return True

    return Subject


BODIES = [empty, single, mixed, inherited, own_methods]
ARGUMENTS: list[dict[str, object]] = [
    {},
    {"value": 1.5},
    {"value": 2},
    {"first": 1.0},
    {"first": float("nan")},
    {"first": 2.0, "second": "b"},
    {"first": 2.0, "third": 4},
    {"first": 2.0, "quiet": 1, "beside": 9, "unhashed": (1,)},
    {"first": 2.0, "beside": 8, "unhashed": (2,), "named": 0},
    {"first": 2.0, "many": [1, 2]},
    {"first": 2.0, "fixed": 1},
    {"unknown": 2.0},
]


@pytest.fixture(params=BODIES, ids=lambda body: body.__name__)
def body(request: pytest.FixtureRequest) -> Callable[[Decorator, dict[str, bool]], type[Any]]:
    return request.param  # type: ignore[no-any-return]


@pytest.fixture(params=OPTIONS, ids=lambda options: "-".join(k for k, v in options.items() if v) or "none")
def options(request: pytest.FixtureRequest) -> dict[str, bool]:
    return request.param  # type: ignore[no-any-return]


def outcome(call: Callable[[], object]) -> object:
    """What comes of a call, in a form that classes of the same name share."""
    try:
        value = call()
    except (AttributeError, TypeError, ValueError) as fault:
        return type(fault), str(fault)
    return value if isinstance(value, bool | int) else repr(value)


def both(body: Any, options: dict[str, bool]) -> tuple[type[Any], type[Any]]:
    return body(STANDARD, options), body(OURS, options)


def test_a_class_is_described_as_before(body: Any, options: dict[str, bool]) -> None:
    standard, ours = both(body, options)
    for of in (
        lambda c: str(inspect.signature(c)),
        dataclasses.is_dataclass,
        lambda c: c.__match_args__,
        lambda c: c.__qualname__,
    ):
        assert of(ours) == of(standard)
    shown = [
        [(f.name, f.type, f.repr, f.compare, f.kw_only) for f in dataclasses.fields(c)]
        for c in (ours, standard)
    ]
    assert shown[0] == shown[1]
    assert ("__slots__" in vars(ours)) == ("__slots__" in vars(standard))
    assert (ours.__hash__ is None) == (standard.__hash__ is None)


def test_objects_behave_as_before(body: Any, options: dict[str, bool]) -> None:
    standard, ours = (answers(cls, by_value=options["eq"]) for cls in both(body, options))
    assert ours == standard
    assert len(ours) > len(ARGUMENTS) + 2


def answers(cls: type[Any], by_value: bool) -> list[object]:
    """What a class answers to the calls that every dataclass knows."""
    calls: list[Callable[[], object]] = [partial(cls, **arguments) for arguments in ARGUMENTS]
    objects = [call() for call in calls if not isinstance(outcome(call), tuple)]
    calls += [partial(cls, 1.0), partial(cls, 1.0, "b", [3])]
    calls += [partial(eq, one, other) for one in objects for other in (*objects, "another")]
    for one in objects:
        calls += [partial(f, one) for f in (dataclasses.asdict, copy.copy, copy.deepcopy)]
        calls += [partial(dataclasses.replace, one, first=5.0)]
        calls += [partial(hash, one)] if by_value and "nan" not in repr(one) else []
    return [outcome(call) for call in calls]


@pytest.mark.parametrize("slots", [True, False])
def test_a_frozen_object_is_closed_and_one_below_may_add_attributes(slots: bool) -> None:
    Subject = mixed(OURS, {"frozen": True, "slots": slots})

    class Below(Subject):  # type: ignore[misc, valid-type]
        pass

    one, below = Subject(1.0), Below(1.0)
    for name in ("first", "absent"):
        with pytest.raises(FrozenInstanceError, match=f"cannot assign to field '{name}'"):
            setattr(one, name, 2.0)
        with pytest.raises(FrozenInstanceError, match=f"cannot delete field '{name}'"):
            delattr(one, name)
    with pytest.raises(FrozenInstanceError):
        below.first = 2.0
    below.absent = 2.0
    assert (below.first, below.absent) == (1.0, 2.0)
    del below.absent
    assert not hasattr(below, "absent")


@lazy_dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Frozen:
    """Of a module, so that it is pickled by its name."""

    first: float
    second: tuple[int, ...] = ()
    inner: Frozen | None = None


@lazy_dataclasses.dataclass(slots=True)
class Open:
    """The same, and changed later."""

    first: float


@pytest.mark.parametrize("one", [Frozen(first=1.0, second=(1,), inner=Frozen(first=2.0)), Open(3.0)])
@pytest.mark.parametrize("protocol", range(2, pickle.HIGHEST_PROTOCOL + 1))
def test_objects_are_pickled(one: object, protocol: int) -> None:
    again = pickle.loads(pickle.dumps(one, protocol))
    assert again == one and again is not one and repr(again) == repr(one)


def test_an_object_that_holds_itself_is_shown() -> None:
    one = mixed(OURS, {"slots": True})(1.0)
    one.many.append(one)
    assert "many=[...]" in repr(one)


def test_nothing_is_compiled_before_the_first_object(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled: list[object] = []
    run = builtins.exec

    def noted(code: Any, *places: Any) -> None:
        compiled.append(code)
        run(code, *places)

    monkeypatch.setattr(builtins, "exec", noted)
    Subject = mixed(OURS, {"frozen": True, "slots": True})
    assert not compiled
    first = Subject(1.0)
    assert len(compiled) == 1
    assert (first, repr(first), hash(Subject)) and Subject(1.0) == first
    assert len(compiled) == 1
