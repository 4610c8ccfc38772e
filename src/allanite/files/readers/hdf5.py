# Specification: The HDF Group, "HDF5 File Format Specification Version 3.0".
# SPDX-License-Identifier: BSD-3-Clause
"""HDF5 files, through h5py, in a child process.

The datasets of one group that are equally long are a table: one-dimensional, n × k, or with fields. Units and the rate
are taken from attributes (of the dataset, its group, or the file) and from scalars such as ``fs``. No link out of the
file is followed, and what was never written is not read as zeros: see `hdf5_tree`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError, LimitError
from allanite.files.readers.arrays import length_of, one_record, picked, table_of
from allanite.files.readers.contents import FilePart, choose_part, listed
from allanite.files.readers.hdf5_tree import Leaf, Tree, read_leaf, text_of, walk
from allanite.files.readers.headings import may_be_time, read_heading
from allanite.files.readers.packed_values import UNIT_KEYS, as_stored
from allanite.files.readers.sandbox import run
from allanite.files.readers.stated_rate import chosen_rate, keyed_statement
from allanite.files.readers.table import Options, Table
from allanite.plain_files.extras import require
from allanite.plain_files.regular_file import regular

NAME: Final = "HDF5"
OPTIONS: Final = frozenset({"variable"})

_MAGIC = b"\x89HDF\r\n\x1a\n"
_MATLAB = b"MATLAB"
_SPARE_MEMORY = 512 << 20
_SMALL = 4096  # elements; smaller arrays may describe the large ones

Arrays = dict[str, NDArray[Any]]


def sniff(head: bytes, path: Path) -> bool:
    """True for the signature at byte 0, 512, 1024 or 2048; MATLAB files have a header of their own in front."""
    return not head.startswith(_MATLAB) and any(head[at : at + 8] == _MAGIC for at in (0, 512, 1024, 2048))


def read(path: Path, options: Options) -> Table:
    """Read the datasets of one group; ``variable`` is a group, or one dataset ("imu0", "imu0/gyro").

    Raises
    ------
    InputError
        The extra `hdf5` is not installed; no such dataset; none of samples.
    FormatError
        A damaged file; one that leads out of itself; samples that were never written; a filter of others.
    LimitError
        It would unpack to far more than its size.
    """
    require("h5py", "hdf5", f"{path.name} is an HDF5 file; reading it")
    size = path.stat().st_size
    facts, arrays = run(
        f"{__name__}:table_in",
        [str(path), options.variable, options.channel_names],
        imports=["h5py"],
        memory=_SPARE_MEMORY + 20 * size,
        seconds=20 + size / 5e6,
        name=path.name,
    )
    small = {k.removeprefix("small "): a for k, a in arrays.items() if k.startswith("small ")}
    samples: Arrays = {}
    units: tuple[str, ...] = ()
    for key, array in (
        (k.removeprefix("samples "), a) for k, a in arrays.items() if k.startswith("samples ")
    ):
        samples |= {f: array[f] for f in array.dtype.names} if array.dtype.names else {key: array}
        units += ("",) * _width(array) if array.dtype.names else (facts["units"][key],) * _width(array)
    table = table_of(samples, small, path, NAME, tuple(facts["guesses"]))
    if any(units) and len(units) == len(table.headings):
        table = replace(table, units=units, units_from="metadata")
    if facts["rates"]:
        stated = chosen_rate(keyed_statement(key, value, "attribute") for key, value in facts["rates"])
        guesses = (*table.guesses, *stated.guesses)
        table = replace(
            table, rate=stated.rate, rate_from=stated.where, rate_doubt=stated.doubt, guesses=guesses
        )
    return replace(table, source={**table.source, **facts["source"]})


def _width(array: NDArray[Any]) -> int:
    """Columns that a dataset becomes."""
    if array.dtype.names:
        return sum(_width(array[f]) for f in array.dtype.names)
    return 1 if array.ndim == 1 else array.size // max(length_of(array.shape), 1)


# -- in the child ------------------------------------------------------------------------------------------


def table_in(path: str, variable: str | None, channels: list[str] | None) -> tuple[dict[str, Any], Arrays]:
    """The group that is asked for (or the best one), and everything that is to be said of it.

    The arguments are those of `allanite.files.readers.read`.
    """
    import h5py

    name = Path(path).name
    with h5py.File(regular(path), "r", locking=False) as file:
        tree = walk(file)
        variable = None if variable is None else variable.strip("/")
        if tree.outside and variable is None:
            raise FormatError(
                f"{name} leads out of itself: {'; '.join(tree.outside[:5])}. Nothing outside the file is "
                "read; choose a part of the rest with variable= (--variable)"
            )
        bare, index = picked(variable)
        if index is not None and bare in tree.leaves:
            return _record(tree.leaves[bare], tree, index, name)
        tables = _tables(tree)
        one = variable if variable in tree.leaves else None
        if one is not None and not any(one in _paths(t) for t in tables.values()):
            leaf = tree.leaves[one]
            raise InputError(f"{name}: {one} is not a table of samples ({leaf.dtype}, shape {leaf.shape})")
        if one is not None:
            tables = {k: t for k, t in tables.items() if one in _paths(t)}
        parts = [_part(key, leaves) for key, leaves in tables.items()]
        part, guesses = choose_part(
            parts,
            next(iter(tables)) if one is not None else _group_of(variable, tables),
            channels,
            file=name,
            option="variable",
            what="group",
        )
        leaves = tables[part.name]
        if one is not None:
            leaves = [leaf for leaf in leaves if leaf.path == one or _is_time(leaf)]
        if any("bomb" in leaf.refused for leaf in leaves):
            raise LimitError(f"{name}: {_why(leaves)}")
        if any(leaf.refused for leaf in leaves):
            raise FormatError(f"{name}: {_why(leaves)}")
        arrays = {f"samples {_last(leaf)}": read_leaf(leaf, name) for leaf in leaves}
        group = part.name.split(" (")[0].strip("/")
        arrays |= {f"small {k}": a for k, a in _small(tree, group, leaves, name).items()}
        facts = {
            "units": {_last(leaf): _unit(leaf) for leaf in leaves},
            "rates": _rate_attributes(leaves, tree, group),
            "guesses": guesses + _unapplied(leaves) + [f"not read: {w}" for w in tree.outside[:20]],
            "source": {"group": part.name, "contents": listed(parts)},
        }
    return facts, arrays


def _record(leaf: Leaf, tree: Tree, index: Any, name: str) -> tuple[dict[str, Any], Arrays]:
    """One record of a dataset of three dimensions, without time: its rate is that of its attributes."""
    if leaf.dtype.kind not in "iuf":
        raise InputError(f"{name}: {leaf.path} is not an array of numbers ({leaf.dtype})")
    last = _last(leaf)
    samples = one_record({last: read_leaf(leaf, name)}, last, index, name)[last]
    facts: dict[str, Any] = {
        "units": {last: _unit(leaf)},
        "rates": _rate_attributes([leaf], tree, leaf.path.rpartition("/")[0]),
        "guesses": _unapplied([leaf]),
        "source": {"group": leaf.path, "contents": []},
    }
    return facts, {f"samples {last}": samples}


def _paths(leaves: list[Leaf]) -> set[str]:
    return {leaf.path for leaf in leaves}


def _why(leaves: list[Leaf]) -> str:
    return "; ".join(f"dataset {leaf.path} {leaf.refused}" for leaf in leaves if leaf.refused)


def _last(leaf: Leaf) -> str:
    return leaf.path.rpartition("/")[2]


def _is_time(leaf: Leaf) -> bool:
    return leaf.dtype.names is None and len(leaf.shape) == 1 and may_be_time(_last(leaf))


def _tables(tree: Tree) -> dict[str, list[Leaf]]:
    """Group (and length, where a group has several) -> the datasets of samples in it, the longest ones first."""
    together: dict[tuple[str, int], list[Leaf]] = {}
    for leaf in tree.leaves.values():
        kind = leaf.dtype.kind in "iuf" or (leaf.dtype.names is not None and len(leaf.shape) == 1)
        if kind and len(leaf.shape) in (1, 2) and length_of(leaf.shape) > 1 and not leaf.dtype.hasobject:
            together.setdefault((leaf.path.rpartition("/")[0], length_of(leaf.shape)), []).append(leaf)
    samples = {
        (group, length): leaves + _time_above(group, length, leaves, together)
        for (group, length), leaves in together.items()
        if not all(map(_is_time, leaves))
    }
    ordered = sorted((samples or together).items(), key=lambda item: -item[0][1])
    tables: dict[str, list[Leaf]] = {}
    for (group, length), leaves in ordered:
        name = f"/{group}"
        tables[f"{name} ({length} rows)" if name in tables else name] = leaves
    return tables


def _time_above(
    group: str, length: int, leaves: list[Leaf], together: Mapping[tuple[str, int], list[Leaf]]
) -> list[Leaf]:
    """Time of the nearest group above that has one of this length, for a group without any."""
    if any(map(_is_time, leaves)):
        return []
    while group:
        group = group.rpartition("/")[0]
        if time := [leaf for leaf in together.get((group, length), []) if _is_time(leaf)]:
            return time
    return []


def _group_of(variable: str | None, tables: Mapping[str, Any]) -> str | None:
    if variable is None:
        return None
    return f"/{variable}" if f"/{variable}" in tables else variable


def _part(name: str, leaves: list[Leaf]) -> FilePart:
    columns = tuple(
        word for leaf in leaves if not _is_time(leaf) for word in (leaf.dtype.names or (_last(leaf),))
    )
    sensor = any(read_heading(c).group in ("gyro", "acc") for c in columns)
    return FilePart(name=name, rows=length_of(leaves[0].shape), columns=columns, rank=0 if sensor else 1)


def _unit(leaf: Leaf) -> str:
    return _as_stored(leaf)[0]


def _unapplied(leaves: list[Leaf]) -> list[str]:
    return [note for leaf in leaves for note in _as_stored(leaf)[1]]


def _as_stored(leaf: Leaf) -> tuple[str, list[str]]:
    unit = next((u for k in UNIT_KEYS if (u := text_of(_attribute(leaf.dataset, k)))), "")
    if _is_time(leaf):
        return unit, []
    return as_stored(_last(leaf), leaf.dataset.dtype, leaf.dataset.attrs, unit)


def _attribute(thing: Any, key: str) -> Any:
    return thing.attrs.get(key, None)


def _rate_attributes(leaves: list[Leaf], tree: Tree, group: str) -> list[tuple[str, float]]:
    """Attributes that state the rate: of the first dataset that has some, else of the group, else of the file."""
    above = [tree.groups[g] for g in (group, "") if g in tree.groups]
    for thing in (*(leaf.dataset for leaf in leaves), *above):
        numbers = [(str(key), _number(thing.attrs.get(key))) for key in thing.attrs]
        stated = [(k, v) for k, v in numbers if v is not None and keyed_statement(k, v, "attribute")]
        if stated:
            return stated
    return []


def _number(value: Any) -> float | None:
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "iuf":
        return None
    return float(array.reshape(()))


def _small(tree: Tree, group: str, leaves: list[Leaf], name: str) -> Arrays:
    """Scalars and lists of words beside the samples, and those of the file."""
    small: Arrays = {}
    taken = _paths(leaves)
    for path, leaf in tree.leaves.items():
        above, _, last = path.rpartition("/")
        size = math.prod(leaf.shape)
        if path in taken or above not in (group, "") or size > _SMALL or leaf.refused:
            continue
        if leaf.dtype.kind in "iuf":
            small[last] = read_leaf(leaf, name)
        elif size <= 64:
            words = [text_of(w) for w in np.asarray(leaf.dataset[()], dtype=object).reshape(-1)]
            if all(words) and words:
                small[last] = np.array(words)
    return small
