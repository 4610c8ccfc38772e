# Specification: MathWorks, "MAT-File Versions" (7.3 is HDF5); attributes MATLAB_* as observed.
# SPDX-License-Identifier: BSD-3-Clause
"""MATLAB files of version 7.3: what `matlab` gets out of older ones, out of HDF5. Runs in a child process.

MATLAB counts its dimensions the other way round: a matrix of n × 3 is stored as 3 × n. Texts are stored as numbers of
characters, cells as references to what is kept in a group of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError
from allanite.files.readers.hdf5_tree import Leaf, Tree, read_leaf, text_of, walk
from allanite.files.readers.matlab_objects import CELL, COMPLEX, STRUCTURES, said_of_objects
from allanite.plain_files.regular_file import regular

__all__ = ["arrays_in"]

#: Groups in which MATLAB keeps what cells and objects refer to.
_INTERNAL: Final = ("#refs#", "#subsystem#")
_NUMBERS: Final = frozenset(
    {"double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}
)
_MOST_CELLS, _LONGEST_TEXT = 1024, 4096


def arrays_in(path: str) -> tuple[dict[str, str], dict[str, NDArray[Any]]]:
    """Every real numeric or text array of a file; fields of structures as "structure.field".

    Returns
    -------
    faults : dict of name to str
        Arrays that cannot be read as they stand, and why.
    arrays : dict of name to ndarray

    Raises
    ------
    FormatError
        The file leads out of itself.
    """
    import h5py

    name = Path(path).name
    with h5py.File(regular(path), "r", locking=False) as file:
        tree = walk(file)
        if tree.outside:
            raise FormatError(
                f"{name} leads out of itself: {'; '.join(tree.outside[:5])}. MATLAB writes no such file"
            )
        faults = {_dotted(leaf.path): leaf.refused for leaf in _own(tree) if leaf.refused}
        faults |= said_of_objects(
            dict(kept for leaf in _own(tree) if (kept := _not_read(leaf, tree, file, name))[1])
        )
        return faults, dict(_arrays(tree, file, name))


def _not_read(leaf: Leaf, tree: Tree, file: Any, name: str) -> tuple[str, str]:
    """Name and class of what may hold samples and is not read; "" as the class of what is."""
    kind = text_of(leaf.dataset.attrs.get("MATLAB_class", ""))
    if leaf.dtype.names == ("real", "imag"):
        return _dotted(leaf.path), COMPLEX
    if kind == "cell" and leaf.dtype.hasobject and not _words(leaf, tree, file, name):
        return _dotted(leaf.path), CELL
    if not kind and leaf.dtype.hasobject:  # a field, as references to its value in each structure
        return _dotted(leaf.path.rpartition("/")[0]), STRUCTURES
    return _dotted(leaf.path), _class_of(leaf)


def _class_of(leaf: Leaf) -> str:
    """Class of a variable that is an object; "" of all others."""
    if "MATLAB_object_decode" not in leaf.dataset.attrs:
        return ""
    kind = text_of(leaf.dataset.attrs.get("MATLAB_class", ""))
    return "" if kind in (*_NUMBERS, "char", "cell", "struct", "logical", "function_handle") else kind


def _dotted(path: str) -> str:
    return path.replace("/", ".")


def _own(tree: Tree) -> Iterator[Leaf]:
    """Datasets that are variables or fields of structures."""
    for path, leaf in tree.leaves.items():
        above = path.rpartition("/")[0]
        sparse = "MATLAB_sparse" in tree.groups[above].attrs if above in tree.groups else False
        if not path.startswith(_INTERNAL) and not sparse and "MATLAB_empty" not in leaf.dataset.attrs:
            yield leaf


def _arrays(tree: Tree, file: Any, name: str) -> Iterator[tuple[str, NDArray[Any]]]:
    for leaf in _own(tree):
        kind = text_of(leaf.dataset.attrs.get("MATLAB_class", ""))
        if leaf.refused:
            continue
        if kind == "char":
            yield _dotted(leaf.path), np.array([_text(leaf, name)])
        elif kind == "cell" and leaf.dtype.hasobject:
            words = _words(leaf, tree, file, name)
            if words:
                yield _dotted(leaf.path), np.array(words)
        elif (kind in _NUMBERS or not kind) and leaf.dtype.kind in "iuf" and leaf.n_bytes:
            array = read_leaf(leaf, name).T
            # MATLAB has no vectors: 1 x n and n x 1 are both lists of samples.
            yield _dotted(leaf.path), array.reshape(-1) if array.ndim == 2 and 1 in array.shape else array


def _text(leaf: Leaf, name: str) -> str:
    if leaf.dtype.kind not in "iu" or leaf.n_bytes > 4 * _LONGEST_TEXT:
        return ""
    return "".join(chr(int(c)) for c in read_leaf(leaf, name).T.reshape(-1)).strip("\0 ")


def _words(leaf: Leaf, tree: Tree, file: Any, name: str) -> list[str]:
    """The texts of a cell of texts; nothing for any other cell."""
    import h5py

    if leaf.n_bytes > 8 * _MOST_CELLS:
        return []
    words = []
    for reference in np.asarray(leaf.dataset[()], dtype=object).T.reshape(-1):
        if not isinstance(reference, h5py.Reference) or not reference:
            return []
        texts = h5py.h5r.get_name(reference, file.id)
        target = tree.leaves.get((texts or b"").decode("utf-8", "replace").strip("/"))
        if (
            target is None
            or target.refused
            or text_of(target.dataset.attrs.get("MATLAB_class", "")) != "char"
        ):
            return []
        words.append(_text(target, name))
    return words
