# Specification: The HDF Group, "HDF5 File Format Specification Version 3.0".
# SPDX-License-Identifier: BSD-3-Clause
"""The numeric datasets of an HDF5 file, without ever leaving it. Runs in a child process.

The library follows links to other files, datasets that are made of other files, and raw data that lies in other files:
a file of a kilobyte can name any file that its reader may open. So nothing is opened by its path: the tree is walked
link by link, only hard links are followed, each object once, and what a dataset declares is compared with what is
stored of it before anything is read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError, LimitError
from allanite.files.readers.packed_values import Packing, packing_of
from allanite.files.readers.spool import BOMB_BYTES, BOMB_RATIO, to_file
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.limits import GROUPS, refuse_more

__all__ = ["Leaf", "Tree", "read_leaf", "text_of", "walk"]

_DEEPEST = 32
_PIECE = 8 << 20  # bytes read at once
#: Filters that are part of the library: deflate, shuffle, fletcher32, szip, nbit, scale-offset, LZF.
_BUILT_IN: Final = frozenset({1, 2, 3, 4, 5, 6, 32000})
_LONGEST_TEXT = 4096


@dataclass(frozen=True, slots=True, kw_only=True)
class Leaf:
    """A dataset.

    Attributes
    ----------
    path : str
        Without the leading slash.
    dataset : h5py.Dataset
    dtype, shape
    refused : str
        Why it cannot be read; "" if it can.
    """

    path: str
    dataset: Any
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    refused: str = ""

    @property
    def n_bytes(self) -> int:
        """Of its samples, unpacked."""
        size = self.dtype.itemsize
        for n in self.shape:
            size *= int(n)
        return size


@dataclass(frozen=True, slots=True, kw_only=True)
class Tree:
    """What a file holds.

    Attributes
    ----------
    leaves : dict of path to Leaf
    groups : dict of path to h5py.Group
    outside : list of str
        Links and datasets that lead out of the file, in words.
    members : list of int
        Of each group that was entered.
    name : str
        Of the file, for messages.
    """

    leaves: dict[str, Leaf] = field(default_factory=dict)
    groups: dict[str, Any] = field(default_factory=dict)
    outside: list[str] = field(default_factory=list)
    members: list[int] = field(default_factory=list)
    name: str = ""

    def count(self, members: int) -> None:
        """Note a group before its members are looked at.

        Raises
        ------
        LimitError
            There are too many in all.
        """
        self.members.append(members)
        refuse_more(
            sum(self.members),
            GROUPS,
            "objects (groups, datasets, links)",
            self.name,
            "Write fewer to one file",
        )


def walk(file: Any) -> Tree:
    """All that hard links lead to.

    Parameters
    ----------
    file : h5py.File

    Raises
    ------
    LimitError
        More than 4096 objects, or groups 32 deep.
    """
    tree = Tree(groups={"": file}, name=Path(file.filename).name)
    visited = {_address(file)}
    _descend(file, "", tree, visited, 0)
    return tree


def _address(thing: Any) -> int:
    import h5py

    return int(h5py.h5o.get_info(thing.id).addr)


def _descend(group: Any, path: str, tree: Tree, visited: set[int], depth: int) -> None:
    import h5py

    if depth > _DEEPEST:
        raise LimitError(f"groups more than {_DEEPEST} deep at {path}: refused")
    tree.count(len(group))  # before any of them is looked at
    for name in group:
        here = f"{path}/{name}" if path else str(name)
        link = group.get(name, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            tree.outside.append(f"{here} is a link to another file")
        if not isinstance(
            link, h5py.HardLink
        ):  # a soft link names what a hard link leads to as well, or nothing
            continue
        if group.get(name, getclass=True) not in (h5py.Group, h5py.Dataset):
            continue
        thing = group[name]
        address = _address(thing)
        if address in visited:
            continue
        visited.add(address)
        if isinstance(thing, h5py.Group):
            tree.groups[here] = thing
            _descend(thing, here, tree, visited, depth + 1)
        else:
            _add(here, thing, tree)


def _add(path: str, dataset: Any, tree: Tree) -> None:
    away = _leads_away(dataset)
    if away:
        tree.outside.append(f"{path} {away}")
        return
    if dataset.shape is None:  # an empty dataset
        return
    shape = tuple(int(n) for n in dataset.shape)
    leaf = Leaf(path=path, dataset=dataset, dtype=dataset.dtype, shape=shape)
    tree.leaves[path] = Leaf(
        path=path, dataset=dataset, dtype=dataset.dtype, shape=shape, refused=_unsound(leaf)
    )


def _leads_away(dataset: Any) -> str:
    """What makes a dataset read from another file, in words; "" if nothing."""
    plan = dataset.id.get_create_plist()
    if plan.get_external_count() > 0:
        return "keeps its samples in another file"
    if dataset.is_virtual and any(source.file_name != "." for source in dataset.virtual_sources()):
        return "is made of datasets in other files"
    return ""


def _unsound(leaf: Leaf) -> str:
    """Why a dataset cannot be read as it stands; "" if it can."""
    import h5py

    dataset, plan = leaf.dataset, leaf.dataset.id.get_create_plist()
    if leaf.dtype.hasobject or leaf.n_bytes == 0 or dataset.is_virtual:
        return ""
    for i in range(plan.get_nfilters()):
        number, _, _, name = plan.get_filter(i)
        if number not in _BUILT_IN:
            shown = name.decode("utf-8", "replace")[:40] if isinstance(name, bytes) else str(name)
            return f"is packed with filter {number} ({shown}), which is not part of HDF5: repack it, h5repack -f GZIP=4"
    stored, declared = int(dataset.id.get_storage_size()), leaf.n_bytes
    if plan.get_layout() == h5py.h5d.CHUNKED:
        wanted = 1
        for n, chunk in zip(leaf.shape, dataset.chunks, strict=True):
            wanted *= -(-n // chunk)
        written = int(dataset.id.get_num_chunks())
        if written < wanted:
            return f"declares {wanted} chunks of samples, but only {written} were written: the writer was interrupted"
        if declared > BOMB_BYTES and declared > BOMB_RATIO * max(stored, 1):
            return f"unpacks from {stored} to {declared} bytes: refused as a decompression bomb"
    elif stored < declared:
        return f"declares {declared} bytes of samples, but {stored} are stored"
    return ""


def read_leaf(leaf: Leaf, name: str) -> NDArray[Any]:
    """The samples, piece by piece into a temporary file where they are many.

    Raises
    ------
    FormatError, LimitError
        The dataset cannot be read as it stands.
    """
    if leaf.refused:
        kind = LimitError if "bomb" in leaf.refused else FormatError
        raise kind(f"{name}: dataset {leaf.path} {leaf.refused}")
    plain = leaf.dtype.newbyteorder("=") if leaf.dtype.names is None else leaf.dtype
    packing = packing_of(leaf.dataset) if leaf.dtype.kind in "iuf" else None
    if packing is not None:
        plain = np.dtype(np.float64)
    if leaf.n_bytes <= _PIECE or len(leaf.shape) == 0:
        return _unpacked(np.asarray(leaf.dataset[()]), packing).astype(plain, copy=False)
    with to_file(_pieces(leaf, plain, packing)) as file:
        return np.memmap(file, dtype=plain, mode="r", shape=leaf.shape)


def _unpacked(values: NDArray[Any], packing: Packing | None) -> NDArray[Any]:
    return values if packing is None else packing.unpacked(values)


def _pieces(leaf: Leaf, dtype: np.dtype[Any], packing: Packing | None) -> Iterator[bytes]:
    rows = leaf.shape[0]
    step = max(_PIECE * rows // leaf.n_bytes, 1)
    chunk = leaf.dataset.chunks[0] if leaf.dataset.chunks else 1
    step = max(step // chunk, 1) * chunk
    for start in range(0, rows, step):
        piece = _unpacked(leaf.dataset[start : start + step], packing)
        yield np.ascontiguousarray(piece, dtype=dtype).tobytes()


def text_of(value: Any) -> str:
    """An attribute or a scalar that is a text; "" for anything else."""
    if isinstance(value, np.ndarray):
        value = value.reshape(-1)[0] if value.size == 1 else ""
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    return str(value)[:_LONGEST_TEXT].strip("\0 ") if isinstance(value, str) else ""
