# Specification: sensor_msgs/Imu, sensor_msgs/Temperature, sensor_msgs/MagneticField (ROS common_interfaces).
# SPDX-License-Identifier: BSD-3-Clause
"""Which messages hold samples of an inertial sensor, found in the definitions of their types.

A message is looked through with all that it holds: an Imu may stand in a message of a driver, or several of them. A
type of another name that has an angular velocity and a linear acceleration is taken as well, without units: its
definition is not the one that fixes them.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

from allanite.files.readers.rosbag.storage import Connection
from allanite.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

__all__ = [
    "IMU",
    "MAGNETIC_FIELD",
    "TEMPERATURE",
    "ImuPlace",
    "MessageLayout",
    "layout_of",
    "may_hold_imu",
    "places_in",
    "typestore_of",
]

#: Fields on the way to a message in another one, each with its position in a list, -1 for all, None for no list.
Way = tuple[tuple[str, int | None], ...]

_IMU = "sensor_msgs/msg/Imu"
_NAME, _ARRAY, _SEQUENCE = 2, 3, 4  # kinds of nodes in a definition
_DEEPEST, _MOST_PLACES = 6, 64


@dataclass(frozen=True, slots=True, kw_only=True)
class MessageLayout:
    """What is read of a message.

    Attributes
    ----------
    fields : tuple of (str, int)
        Names of the fields, and where each begins, in bytes from the end of the serialised message: in front stands
        the name of a frame, of any length.
    vector : bool
        The fields are vectors x, y, z; else they are numbers.
    names, units : tuple of str
        One per number.
    shortest : int
        Bytes of the shortest message.
    """

    fields: tuple[tuple[str, int], ...]
    vector: bool
    names: tuple[str, ...]
    units: tuple[str, ...]
    shortest: int


# Bytes from the end: behind each field of float64 stand the rest and the covariances.
IMU: Final = MessageLayout(
    fields=(("angular_velocity", 192), ("linear_acceleration", 96)),
    vector=True,
    names=("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z"),
    units=("rad/s",) * 3 + ("m/s²",) * 3,
    shortest=4 + 8 + 4 + 37 * 8,
)
TEMPERATURE: Final = MessageLayout(
    fields=(("temperature", 16),),
    vector=False,
    names=("temperature",),
    units=("°C",),
    shortest=4 + 8 + 4 + 16,
)
MAGNETIC_FIELD: Final = MessageLayout(
    fields=(("magnetic_field", 96),),
    vector=True,
    names=("mag_x", "mag_y", "mag_z"),
    units=("T",) * 3,
    shortest=4 + 8 + 4 + 96,
)
_STANDARD: Final = {
    _IMU: IMU,
    "sensor_msgs/msg/Temperature": TEMPERATURE,
    "sensor_msgs/msg/MagneticField": MAGNETIC_FIELD,
}


def layout_of(kind: str) -> MessageLayout | None:
    """Layout of a standard message."""
    return _STANDARD.get(kind)


@dataclass(frozen=True, slots=True)
class ImuPlace:
    """Where an Imu stands in the messages of a type.

    Attributes
    ----------
    path : Way
        Empty for a message that is an Imu itself.
    standard : bool
        It is a sensor_msgs/Imu: its units are fixed.
    """

    path: Way
    standard: bool

    def __str__(self) -> str:
        return ".".join(f + ("" if k is None else "[]" if k < 0 else f"[{k}]") for f, k in self.path)

    @property
    def several(self) -> bool:
        """A message holds a list of them."""
        return any(k is not None and k < 0 for _, k in self.path)

    def at(self, position: int) -> ImuPlace:
        """One of the list."""
        path = tuple((f, position if k is not None and k < 0 else k) for f, k in self.path)
        return ImuPlace(path, self.standard)


def may_hold_imu(connection: Connection) -> bool:
    """Whether it is worth understanding the definition: it names an Imu, or a field of one, somewhere."""
    return not connection.form or any(word in connection.definition for word in ("/Imu", IMU.fields[0][0]))


def typestore_of(connection: Connection) -> Typestore | None:
    """The types that a connection defines, or those of the ROS distribution where it defines none; None if unknown."""
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    if connection.encoding not in ("cdr", "ros1"):
        return None
    if not connection.form:
        store = get_typestore(Stores.ROS2_HUMBLE if connection.encoding == "cdr" else Stores.ROS1_NOETIC)
        return store if connection.kind in store.fielddefs else None
    store = get_typestore(Stores.EMPTY)
    types: dict[str, Any] = {}
    try:
        if connection.form == "msg":
            types = dict(get_types_from_msg(connection.definition, connection.kind))
        else:
            for text in _idl_files(connection.definition):
                types |= get_types_from_idl(text)
        store.register(types)
    except Exception:  # noqa: BLE001  (whatever the library raises: a type that cannot be understood is none of ours)
        return None
    return store if connection.kind in store.fielddefs else None


def _idl_files(text: str) -> list[str]:
    """Several files in one text, each behind a line of signs and its name."""
    line = "=" * 80 + "\nIDL: "
    if not text.startswith(line):
        return [text]
    return [part.split("\n", 1)[-1] for part in text.split(line)[1:]]


def places_in(store: Typestore, kind: str) -> list[ImuPlace]:
    """Where Imu messages stand in the messages of a type, first the ones on top."""
    places = list(islice(_walk(store, kind, (), _DEEPEST, _leading(store)), _MOST_PLACES))
    return sorted(places, key=lambda p: (not p.standard, len(p.path)))


def _inside(store: Typestore, kind: str) -> Iterator[tuple[str, str, bool]]:
    """Fields of a type that are messages themselves: name, type, and whether it is a list of them."""
    if kind not in store.fielddefs:
        return
    for name, node in store.fielddefs[kind][1]:
        what: Any = node[1]
        if int(node[0]) == _NAME:
            yield str(name), str(what), False
        elif int(node[0]) in (_ARRAY, _SEQUENCE) and int(what[0][0]) == _NAME:
            yield str(name), str(what[0][1]), True


def _looks_like_imu(store: Typestore, kind: str) -> bool:
    vectors = {name for name, what, list_ in _inside(store, kind) if not list_ and _is_vector(store, what)}
    return {name for name, _ in IMU.fields} <= vectors


def _leading(store: Typestore) -> frozenset[str]:
    """Types with an Imu in them, at any depth: a definition may branch without end, and most branches lead nowhere."""
    holders: dict[str, set[str]] = {}
    for kind in store.fielddefs:
        for _, what, _ in _inside(store, kind):
            holders.setdefault(what, set()).add(kind)
    waiting = [kind for kind in store.fielddefs if kind == _IMU or _looks_like_imu(store, kind)]
    leading = set(waiting)
    while waiting:
        new = holders.get(waiting.pop(), set()) - leading
        leading |= new
        waiting += new
    return frozenset(leading)


def _walk(store: Typestore, kind: str, path: Way, deep: int, leading: frozenset[str]) -> Iterator[ImuPlace]:
    if kind == _IMU or _looks_like_imu(store, kind):
        yield ImuPlace(path, kind == _IMU)
        return
    if deep == 0 or kind not in leading:
        return
    for name, what, several in _inside(store, kind):
        if not several:
            yield from _walk(store, what, (*path, (name, None)), deep - 1, leading)
        elif not any(k == -1 for _, k in path):
            yield from _walk(store, what, (*path, (name, -1)), deep - 1, leading)


def _is_vector(store: Typestore, kind: str) -> bool:
    return kind in store.fielddefs and {"x", "y", "z"} <= {
        str(field[0]) for field in store.fielddefs[kind][1]
    }
