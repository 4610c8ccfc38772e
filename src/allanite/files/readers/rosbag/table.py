# SPDX-License-Identifier: BSD-3-Clause
"""What is read of a recording of ROS: a topic with Imu messages, and companions of it. Runs in a child process."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError
from allanite.files.readers.contents import FilePart, choose_part
from allanite.files.readers.rosbag.bag1 import Bag1
from allanite.files.readers.rosbag.companions import Companion, beside, companions_of
from allanite.files.readers.rosbag.decoding import Decoder
from allanite.files.readers.rosbag.mcap import MAGIC as MCAP
from allanite.files.readers.rosbag.mcap import Mcap
from allanite.files.readers.rosbag.sqlite import MAGIC as SQLITE
from allanite.files.readers.rosbag.sqlite import Sqlite
from allanite.files.readers.rosbag.storage import Connection, Storage
from allanite.files.readers.rosbag.types import IMU, ImuPlace, may_hold_imu, places_in, typestore_of
from allanite.files.readers.spool import GrowingColumn, refuse_bomb, to_file
from allanite.plain_files.limits import PARTS, TYPE_CHARACTERS, refuse_more
from allanite.plain_files.regular_file import open_regular, regular

__all__ = ["BAG", "MCAP", "SQLITE", "table_in"]

BAG: Final = b"#ROSBAG V"
_OPENED: Final[dict[bytes, Callable[[Path], Storage]]] = {BAG: Bag1, MCAP: Mcap, SQLITE: Sqlite}
#: Topics that are taken first where there are several, and the ends of their names in a namespace.
_USUAL: Final = ("/imu/data_raw", "/imu/data", "/imu0")
_LOT, _LOT_BYTES = 50_000, 64 << 20  # messages decoded together

Arrays = dict[str, NDArray[Any]]


def table_in(path: str, topic: str | None, channels: list[str] | None) -> tuple[dict[str, Any], Arrays]:
    """The samples of the topic that is asked for (or the best one), and everything that is to be said of it.

    The arguments are those of `allanite.files.readers.read`.

    Raises
    ------
    InputError
        No topic with Imu messages, or not the one asked for; the message lists the topics.
    FormatError
        A damaged recording.
    """
    place = Path(path)
    with ExitStack() as stack:
        storages = _opened(place, stack)
        choice = _choose(storages, topic, place.name)
        companions, undecided = companions_of(storages, choice.topic, channels)
        lots = {k: _Lots(choice.decoder(c)) for k, c in choice.connections.items()}
        others = {k: _Lots(c.decoder()) for k, c in companions.items()}
        _read(storages, {**lots, **others})
        remarks = [r for s in storages for r in s.remarks]
    stamps, received, numbers = _together([lot.finish() for lot in lots.values()])
    guesses = [*choice.guesses, *dict.fromkeys(remarks), *_told(choice, lots)]
    time = stamps
    if len(stamps) and not stamps[:1000].any():
        time = received
        guesses.append("the header stamps are zero: the times of reception are used")
    absent = next((lot.decoder.absent for lot in lots.values() if lot.decoder.absent), (False, False))
    keep = [i for i in range(6) if not absent[i // 3]]
    if len(keep) < 6:
        guesses.append("channels that the messages mark as absent (covariance -1) are left out")
    units = IMU.units if choice.place.standard else ("",) * 6
    arrays: Arrays = {"stamp": time, **{IMU.names[i]: numbers[i] for i in keep}}
    placed, remarks_of_companions = beside(time, _finished(companions, others), zero=time is received)
    head = {
        "headings": list(arrays),
        "units": ["", *(units[i] for i in keep)],
        "companions": [{"name": c.name, "unit": c.unit, "rows": c.rows} for c in placed],
        "guesses": [*guesses, *remarks_of_companions, *undecided],
        "source": {
            "topic": choice.name,
            "message_type": next(iter(choice.connections.values())).kind,
            "topics": sorted({f"{c.topic} ({c.kind}, {c.count})" for s in storages for c in s.connections}),
        },
    }
    arrays |= {key: array for c in placed for key, array in c.arrays.items()}
    return head, arrays


# -- files -------------------------------------------------------------------------------------------------


def _opened(place: Path, stack: ExitStack) -> list[Storage]:
    """The containers of a file or of a folder, by their content."""
    files = [place]
    if place.is_dir():
        kinds = {s: sorted([*place.glob(f"*{s}"), *place.glob(f"*{s}.zstd")]) for s in (".db3", ".mcap")}
        there = [s for s, containers in kinds.items() if containers]
        if len(there) != 1:
            what = "both .db3 and .mcap files" if there else "neither .db3 nor .mcap files"
            raise InputError(f"{place.name} holds {what}; give one file")
        files = kinds[there[0]]
    return [_storage(file, stack) for file in files]


def _storage(file: Path, stack: ExitStack) -> Storage:
    with open_regular(file) as opened:
        head = opened.read(16)
    if head.startswith(b"\x28\xb5\x2f\xfd"):
        file = stack.enter_context(_unpacked(file))
        with open_regular(file) as opened:
            head = opened.read(16)
    for magic, kind in _OPENED.items():
        if head.startswith(magic):
            storage = kind(file)
            stack.callback(storage.close)
            return storage
    raise FormatError(f"{file.name}: neither a bag nor SQLite nor MCAP")


@contextmanager
def _unpacked(file: Path) -> Iterator[Path]:
    """A file packed with zstd, unpacked beside for the time of reading."""
    with tempfile.TemporaryDirectory(prefix="allanite-") as folder:
        place = Path(folder) / file.name.removesuffix(".zstd")
        with place.open("w+b") as target:
            to_file(_pieces(file), target)
        yield place


def _pieces(file: Path) -> Iterator[bytes]:
    import pyarrow as pa

    packed, done = file.stat().st_size, 0
    try:
        with pa.CompressedInputStream(pa.OSFile(str(regular(file))), "zstd") as stream:
            while piece := bytes(stream.read(1 << 20)):
                done += len(piece)
                refuse_bomb(packed, done, file.name)
                yield piece
    except OSError as error:
        raise FormatError(f"{file.name}: damaged zstd file ({str(error)[:100]})") from None


# -- the topic ---------------------------------------------------------------------------------------------


class _Choice:
    """The topic that is read, and where in its messages the samples stand."""

    def __init__(
        self, name: str, place: ImuPlace, connections: dict[tuple[int, int], Connection], guesses: list[str]
    ) -> None:
        self.name, self.place, self.connections, self.guesses = name, place, connections, guesses
        self.topic = next(iter(connections.values())).topic

    def decoder(self, connection: Connection) -> Decoder:
        store = typestore_of(connection)
        if store is None:
            raise FormatError(
                f"topic {connection.topic}: the definition of {connection.kind} cannot be parsed"
            )
        return Decoder(connection=connection, store=store, layout=IMU, place=self.place)


def _choose(storages: Sequence[Storage], topic: str | None, name: str) -> _Choice:
    everything = {(i, c.key): c for i, s in enumerate(storages) for c in s.connections}
    refuse_more(len(everything), PARTS, "topics", name, "Filter it: 'rosbag filter', or 'ros2 bag convert'")
    texts = {c.definition for c in everything.values() if may_hold_imu(c)}
    refuse_more(
        sum(map(len, texts)),
        TYPE_CHARACTERS,
        "characters of definitions of messages",
        name,
        "Keep the topics of sensors",
    )
    listed = sorted({f"{c.topic} ({c.kind}, {c.count})" for c in everything.values()})
    places: dict[str, tuple[Connection, ImuPlace]] = {}
    known: dict[tuple[str, str], list[ImuPlace]] = {}
    for c in everything.values():
        kind = (c.kind, c.definition)
        if kind not in known:
            store = typestore_of(c) if may_hold_imu(c) else None
            known[kind] = [] if store is None else places_in(store, c.kind)
        for p in known[kind]:
            label = c.topic if len(known[kind]) == 1 and not p.several else f"{c.topic}.{p}"
            places.setdefault(label, (c, p))
    if topic is not None:
        label, place = _asked(topic, places, [c.topic for c in everything.values()], listed, name)
        connection, guesses = places[label][0], list[str]()
        name_read = f"{connection.topic}.{place}" if label != connection.topic else label
    elif not places:
        raise InputError(f"{name}: no topic with messages of an Imu; found: {', '.join(listed) or 'none'}")
    else:
        messages = Counter[tuple[str, str]]()
        for c in everything.values():
            messages[c.topic, c.kind] += c.count
        counts = {label: messages[c.topic, c.kind] for label, (c, _) in places.items()}
        parts = [
            FilePart(name=label, rows=counts[label], columns=IMU.names, rank=_rank(c, p))
            for label, (c, p) in places.items()
        ]
        parts.sort(key=lambda part: part.name)
        full = parts if any(part.rows for part in parts) else [_one_row(part) for part in parts]
        best, guesses = choose_part(full, None, None, file=name, option="topic", what="topic")
        connection, place = places[best.name]
        name_read = best.name
    same = {k: c for k, c in everything.items() if (c.topic, c.kind) == (connection.topic, connection.kind)}
    if not place.standard:
        guesses.append(
            f"{connection.kind} has the fields of an Imu, but another name: its units are unknown; state "
            "them (--unit gyro=rad/s,acc=m/s²)"
        )
    return _Choice(name_read, place, same, guesses)


def _one_row(part: FilePart) -> FilePart:
    return FilePart(name=part.name, rows=1, columns=part.columns, rank=part.rank)


def _rank(connection: Connection, place: ImuPlace) -> int:
    """The usual topics first, then any Imu, then one inside of another message, then what only looks like one."""
    for rank, usual in enumerate(_USUAL):
        if connection.topic == usual:
            return rank
    if not place.standard:
        return 40
    if place.path:
        return 30 if place.several else 20
    return 10 + next((r for r, usual in enumerate(_USUAL) if connection.topic.endswith(usual)), len(_USUAL))


def _asked(
    topic: str,
    places: dict[str, tuple[Connection, ImuPlace]],
    topics: Sequence[str],
    listed: Sequence[str],
    name: str,
) -> tuple[str, ImuPlace]:
    """The place that the caller names: a topic, a topic with a field, or one of a list in it."""
    topic = "/" + topic.lstrip("/")
    if topic in places:
        return topic, places[topic][1]
    inside = [label for label in places if label.startswith(f"{topic}.")]
    if len(inside) == 1:
        return inside[0], places[inside[0]][1]
    if inside:
        raise InputError(f"{name}: several Imu messages in {topic}; choose one: {', '.join(inside)}")
    for label, (_, place) in places.items():
        before, brackets, after = label.partition("[]")
        if brackets and topic.startswith(f"{before}[") and topic.endswith(f"]{after}"):
            position = topic[len(before) + 1 : len(topic) - len(after) - 1]
            if position.isdigit():
                return label, place.at(int(position))
    why = "holds no Imu messages" if topic in topics else "is not there"
    raise InputError(f"{name}: topic {topic} {why}; found: {', '.join(listed) or 'none'}")


# -- messages ----------------------------------------------------------------------------------------------

_Finished = tuple[NDArray[np.int64], NDArray[np.int64], list[NDArray[np.float64]]]


class _Lots:
    """Messages of a connection, gathered until there are enough to be decoded together."""

    def __init__(self, decoder: Decoder) -> None:
        self.decoder = decoder
        self._messages: list[bytes] = []
        self._received: list[int] = []
        self._bytes = self.count = 0
        columns = len(decoder.layout.names) + 2

        def growing(kind: type) -> GrowingColumn:
            return GrowingColumn(np.dtype(kind), beside=columns)

        self._stamps, self._times = growing(np.int64), growing(np.int64)
        self._numbers = [growing(np.float64) for _ in decoder.layout.names]

    def add(self, received: list[int], messages: list[bytes]) -> None:
        self._received += received
        self._messages += messages
        self.count += len(messages)
        self._bytes += sum(map(len, messages))
        if len(self._messages) >= _LOT or self._bytes >= _LOT_BYTES:
            self._decode()

    def _decode(self) -> None:
        if not self._messages:
            return
        (stamps, numbers), times = self.decoder.decode(self._messages, self._received)
        self._stamps.append(stamps)
        self._times.append(times)
        for i, column in enumerate(self._numbers):
            column.append(np.ascontiguousarray(numbers[:, i]))
        self._messages, self._received, self._bytes = [], [], 0

    def finish(self) -> _Finished:
        self._decode()
        return (
            self._stamps.finish_array(),
            self._times.finish_array(),
            [c.finish_array() for c in self._numbers],
        )


def _read(storages: Sequence[Storage], lots: dict[tuple[int, int], _Lots]) -> None:
    """Every file once, whatever is taken from it."""
    for i, storage in enumerate(storages):
        keys = [key for k, key in lots if k == i]
        if not keys:
            continue
        for batch in storage.batches(keys):
            for key, (received, messages) in batch.items():
                lots[i, key].add(received, messages)


def _together(parts: Sequence[_Finished]) -> _Finished:
    """Several connections as one, in the order of reception."""
    if len(parts) == 1:
        stamps, times, numbers = parts[0]
    else:
        stamps, times = (np.concatenate([p[k] for p in parts]) for k in (0, 1))
        numbers = [np.concatenate([p[2][i] for p in parts]) for i in range(len(parts[0][2]))]
    if len(times) > 1 and (np.diff(times) < 0).any():
        order = np.argsort(times, kind="stable")
        stamps, times, numbers = stamps[order], times[order], [n[order] for n in numbers]
    return stamps, times, numbers


def _told(choice: _Choice, lots: dict[tuple[int, int], _Lots]) -> list[str]:
    """A container that lists other numbers of messages than it holds."""
    listed = sum(c.count for c in choice.connections.values())
    there = sum(lot.count for lot in lots.values())
    if listed == there:
        return []
    return [f"the recording lists {listed} messages of {choice.topic}, but has {there}"]


def _finished(
    companions: dict[tuple[int, int], Companion], others: dict[tuple[int, int], _Lots]
) -> list[tuple[Companion, _Finished]]:
    """The companions by topic, each with what was read of it."""
    by_topic: dict[str, list[tuple[int, int]]] = {}
    for k, c in companions.items():
        by_topic.setdefault(c.topic, []).append(k)
    return [(companions[ks[0]], _together([others[k].finish() for k in ks])) for ks in by_topic.values()]
