# SPDX-License-Identifier: BSD-3-Clause
"""Files of arrays and tables: NumPy, Arrow, HDF5, MATLAB, TDMS."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from tests.hostile_shapes.shape import DEEP, DIGITS, RATE, HostileShape, Write, holding, zipped

# -- NumPy -------------------------------------------------------------------------------------------------


def _header(shape: str, descr: str = "'<f8'", body: bytes = b"") -> Write:
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"
    return holding(b"\x93NUMPY\x02\x00" + len(text).to_bytes(4, "little") + text.encode() + body)


def npy(wide: int) -> Iterator[HostileShape]:
    huge = "0x" + "f" * 5000
    fields = "[" + ",".join(f"('{k}','u1')" for k in range(900)) + "]"
    nested = "'u1'"
    for k in range(150):
        nested = f"[('a{k}',{nested})]"
    table = {
        "201 dimensions": ("(" + "1," * 201 + ")", "'<f8'", bytes(8), "dimensions"),
        "65 dimensions, empty": ("(0," + "1," * 64 + ")", "'<f8'", b"", "dimensions"),
        "length of 5000 digits": (f"({DIGITS},)", "'<f8'", b"", "header"),
        "length of 5000 hexadecimal digits": (f"({huge},)", "'<f8'", b"", "damaged"),
        "length beyond 64 bits, empty": (f"({1 << 70},0)", "'<f8'", b"", "damaged"),
        "length beyond 64 bits, samples of no bytes": (f"({1 << 62},)", "'V0'", b"", ""),
        "900 fields": ("(2,)", fields, bytes(1800), ""),
        "type nested 150 deep": ("(2,)", nested, bytes(2), ""),
        "type of a terabyte": ("(1,)", f"'S{1 << 40}'", b"", "cannot be read|missing"),
        "type with a negative offset": ("(1,)", "{'names':['a'],'formats':['f8'],'offsets':[-8]}", b"", ""),
        "type that is a number": ("(1,)", "7", bytes(8), ""),
        "thirty thousand columns": ("(65,30000)", "'u1'", bytes(1_950_000), "columns"),
    }
    for name, (shape, descr, body, says) in table.items():
        options = RATE
        yield HostileShape(
            name=f"npy, {name}", file="a.npy", write=_header(shape, descr, body), says=says, options=options
        )
    many = HostileShape(
        name="npz, many arrays", file="a.npz", write=lambda p: _npz(p, wide), says="arrays", options=RATE
    )
    yield many
    yield HostileShape(
        name="npz, one name many times",
        file="a.npz",
        write=lambda p: _npz(p, wide, "a.npy"),
        says="arrays",
        options=RATE,
    )
    yield HostileShape(
        name="zip, many empty members",
        file="a.zip",
        write=lambda p: zipped(p, {f"{k}.txt": b"" for k in range(4 * wide)}),
        says="zip",
    )


def _npz(path: Path, count: int, name: str = "") -> None:
    stream = io.BytesIO()
    np.save(stream, np.zeros(3))
    import warnings

    with zipfile.ZipFile(path, "w") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for k in range(count):
            archive.writestr(name or f"a{k}.npy", stream.getvalue())


# -- Arrow -------------------------------------------------------------------------------------------------


def _arrow_file(form: str, columns: int, metadata: dict[bytes, bytes] | None = None, rows: int = 3) -> Write:
    def write(path: Path) -> None:
        import pyarrow as pa
        import pyarrow.feather as feather
        import pyarrow.parquet as pq

        values = pa.array(np.arange(rows, dtype=float))
        table = pa.table({f"c{k}": values for k in range(columns)}).replace_schema_metadata(metadata)
        if form == "parquet":
            pq.write_table(table, path, compression="none", write_statistics=False, use_dictionary=False)
        elif form == "feather":
            feather.write_feather(table, path, version=1)
        else:
            opened = pa.ipc.new_file if form == "arrow" else pa.ipc.new_stream
            with opened(str(path), table.schema) as writer:
                writer.write_table(table)

    return write


def _namesakes(form: str) -> Write:
    """Two columns of one name, with other values."""

    def write(path: Path) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = pa.Table.from_arrays([pa.array([1.0, 2.0]), pa.array([3.0, 4.0])], names=["x", "x"])
        if form == "parquet":
            pq.write_table(table, path)
            return
        with pa.ipc.new_file(str(path), table.schema) as writer:
            writer.write_table(table)

    return write


def _arrow_groups(form: str, groups: int) -> Write:
    def write(path: Path) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = pa.table({"c": np.arange(float(groups))})
        if form == "parquet":
            pq.write_table(table, path, row_group_size=1, compression="none")
            return
        with pa.ipc.new_file(str(path), table.schema) as writer:
            for batch in table.to_batches(max_chunksize=1):
                writer.write_batch(batch)

    return write


def _nested_type(depth: int) -> Write:
    def write(path: Path) -> None:
        import pyarrow as pa

        kind = pa.float64()
        for _ in range(depth):
            kind = pa.struct([("a", kind)])
        schema = pa.schema([("x", pa.float64()), ("n", kind)])
        with pa.ipc.new_stream(str(path), schema) as writer:
            writer.write_batch(pa.record_batch([pa.array([1.0, 2.0]), pa.nulls(2, kind)], schema=schema))

    return write


def _ours(content: str) -> dict[bytes, bytes]:
    return {b"allanite": content.encode()}


def arrow(wide: int) -> Iterator[HostileShape]:
    for form in ("parquet", "arrow", "stream", "feather"):
        yield HostileShape(
            name=f"{form}, too many columns",
            file=f"a.{form}",
            write=_arrow_file(form, wide),
            says="columns",
            options=RATE,
        )
    for form in ("parquet", "arrow"):
        yield HostileShape(
            name=f"{form}, too many row groups",
            file=f"a.{form}",
            write=_arrow_groups(form, 20 * wide),
            says="groups|batches",
            options=RATE,
        )
    yield HostileShape(
        name="stream, type nested 60 deep", file="a.arrows", write=_nested_type(60), options=RATE
    )
    for form in ("parquet", "arrow"):
        yield HostileShape(
            name=f"{form}, two columns of one name",
            file=f"a.{form}",
            write=_namesakes(form),
            says="several columns have the name 'x'",
            options=RATE,
        )
    facts = '{{"rate": {}, "start": {}, "channels": {}, "history": {}}}'
    damaged = {
        "rate of 400 digits": facts.format("9" * 400, "null", "[]", "[]"),
        "rate of 5000 digits": facts.format(DIGITS, "null", "[]", "[]"),
        "start that is infinite": facts.format("100", "1e400", "[]", "[]"),
        "nesting": "[" * DEEP,
        "channels that are numbers": facts.format("100", "null", "[1, 2]", "[]"),
        "no object": "[]",
        "history of numbers": facts.format("100", "null", "[]", "[1, 2]"),
    }
    for name, content in damaged.items():
        yield HostileShape(
            name=f"parquet of allanite, {name}",
            file="a.parquet",
            write=_arrow_file("parquet", 2, _ours(content)),
            says="damaged",
            options=RATE,
        )
    for name, content in {
        "nesting": "[" * DEEP,
        "no object": "7",
        "digits": f'{{"header": {DIGITS}}}',
    }.items():
        yield HostileShape(
            name=f"compacted run, {name}",
            file="a.parquet",
            write=_arrow_file("parquet", 2, {b"allanite.run": content.encode()}),
            says="damaged",
        )


# -- HDF5, MATLAB, TDMS ------------------------------------------------------------------------------------


def _h5(fill: Callable[[Any], None], **options: Any) -> Write:
    def write(path: Path) -> None:
        import h5py

        with h5py.File(path, "w", **options) as file:
            fill(file)

    return write


def _many_groups(count: int) -> Callable[[Any], None]:
    def fill(file: Any) -> None:
        for k in range(count):
            file.create_group(f"g{k}")

    return fill


def _many_sets(count: int) -> Callable[[Any], None]:
    def fill(file: Any) -> None:
        for k in range(count):
            file.create_dataset(f"d{k}", data=[1.0, 2.0])

    return fill


def _many_attributes(count: int) -> Callable[[Any], None]:
    def fill(file: Any) -> None:
        set_ = file.create_dataset("gyro", data=np.ones((20, 3)))
        for k in range(count):
            set_.attrs[f"a{k}"] = k

    return fill


def _many_links(count: int) -> Callable[[Any], None]:
    def fill(file: Any) -> None:
        import h5py

        file["gyro"] = np.ones((20, 3))
        for k in range(count):
            file[f"s{k}"] = h5py.SoftLink("/gyro") if k % 2 else h5py.ExternalLink("b.h5", "/x")

    return fill


def _deep_groups(file: Any) -> None:
    group = file
    for _ in range(200):
        group = group.create_group("g")


def _many_fields(file: Any) -> None:
    file["table"] = np.zeros(3, dtype=[(f"f{k}", "f4") for k in range(1500)])


def hdf5(wide: int) -> Iterator[HostileShape]:
    table = {
        "groups": (_many_groups(wide), "objects"),
        "datasets": (_many_sets(wide), "objects"),
        "attributes": (_many_attributes(wide), ""),
        "links": (_many_links(wide), "objects|links"),
    }
    for name, (fill, says) in table.items():
        yield HostileShape(
            name=f"HDF5, many {name}",
            file="a.h5",
            write=_h5(fill, libver="latest"),
            says=says,
            options=RATE,
        )
    yield HostileShape(
        name="HDF5, deep groups", file="a.h5", write=_h5(_deep_groups), says="deep", options=RATE
    )
    yield HostileShape(
        name="HDF5, dataset of too many columns",
        file="a.h5",
        write=_h5(lambda file: file.create_dataset("x", data=np.zeros((6000, min(wide, 5000)), dtype="u1"))),
        says="columns",
        options=RATE,
    )
    yield HostileShape(
        name="HDF5, many fields",
        file="a.h5",
        write=_h5(_many_fields, libver="latest"),
        says="",
        options=RATE,
    )


def _mat(fill: Callable[[], dict[str, Any]]) -> Write:
    def write(path: Path) -> None:
        from scipy.io import savemat

        savemat(path, fill(), long_field_names=True)

    return write


def _element(kind: int, body: bytes) -> bytes:
    return struct.pack("<II", kind, len(body)) + body + bytes(-len(body) % 8)


def _mat_head(body: bytes) -> bytes:
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + body


def _cells(depth: int) -> bytes:
    """A cell in a cell in a cell."""
    inner = b""
    for _ in range(depth):
        flags = _element(6, struct.pack("<II", 1, 0))
        size = _element(5, struct.pack("<ii", 1, 1 if inner else 0))
        inner = _element(14, flags + size + _element(1, b"") + inner)
    return inner


def _structs(depth: int) -> dict[str, Any]:
    inner: Any = np.ones((20, 3))
    for _ in range(depth):
        inner = {"a": inner}
    return {"s": inner}


def matlab(wide: int) -> Iterator[HostileShape]:
    many = {f"v{k}": np.ones(20) for k in range(wide)}
    table: dict[str, tuple[Write, str]] = {
        "too many variables": (_mat(lambda: many), "variables"),
        "too many fields": (_mat(lambda: {"s": many}), "variables"),
        "structures 60 deep": (_mat(lambda: _structs(60)), ""),
        "cells 3000 deep": (holding(_mat_head(_cells(3000))), ""),
        "cells 60 000 deep, packed": (
            holding(_mat_head(_element(15, zlib.compress(_cells(3000)))[: -8 or None])),
            "",
        ),
        "100 000 empty elements": (holding(_mat_head(_element(14, b"") * 100_000)), ""),
        "too many columns": (
            _mat(lambda: {"x": np.zeros((6000, min(wide, 5000)), dtype=np.uint8)}),
            "columns",
        ),
    }
    for name, (write, says) in table.items():
        yield HostileShape(name=f"MATLAB 5, {name}", file="a.mat", write=write, says=says, options=RATE)

    def write73(path: Path) -> None:
        _h5(_many_sets(wide), userblock_size=512, libver="latest")(path)
        with path.open("r+b") as raw:
            raw.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")

    yield HostileShape(
        name="MATLAB 7.3, too many variables", file="a73.mat", write=write73, says="objects", options=RATE
    )


def _tdms_text(text: str) -> bytes:
    return struct.pack("<I", len(text.encode())) + text.encode()


def _tdms_segment(objects: list[bytes], raw: bytes = b"") -> bytes:
    meta = struct.pack("<I", len(objects)) + b"".join(objects)
    return b"TDSm" + struct.pack("<IIQQ", 0x0E, 4713, len(meta) + len(raw), len(meta)) + meta + raw


def _tdms_object(path: str, properties: int = 0) -> bytes:
    """An object without samples."""
    more = b"".join(_tdms_text(f"p{k}") + struct.pack("<Ii", 3, k) for k in range(properties))
    return _tdms_text(path) + struct.pack("<I", 0xFFFFFFFF) + struct.pack("<I", properties) + more


def _tdms_channel(path: str) -> bytes:
    """A channel with two float64 in each segment."""
    return _tdms_text(path) + struct.pack("<IIIQ", 20, 10, 1, 2) + struct.pack("<I", 0)


def tdms(wide: int) -> Iterator[HostileShape]:
    root = _tdms_object("/")
    channels = [_tdms_channel(f"/'g'/'c{k}'") for k in range(wide)]
    groups = [_tdms_object(f"/'g{k}'") for k in range(wide)]
    one = [root, _tdms_object("/'g'"), _tdms_channel("/'g'/'c'")]
    table = {
        "channels": (_tdms_segment([root, _tdms_object("/'g'"), *channels], bytes(16 * wide)), "channels"),
        "groups": (_tdms_segment([root, *groups]), "groups|channels"),
        "properties": (_tdms_segment([_tdms_object("/", wide), *one[1:]], bytes(16)), ""),
        "segments": (_tdms_segment(one, bytes(16)) * (4 * wide), ""),
    }
    for name, (content, says) in table.items():
        yield HostileShape(
            name=f"TDMS, many {name}", file="a.tdms", write=holding(content), says=says, options=RATE
        )
    promise = _tdms_text("/'g'/'c'") + struct.pack("<IIIQ", 20, 10, 1, 1 << 60) + struct.pack("<I", 0)
    yield HostileShape(
        name="TDMS, a channel of 2**60 samples",
        file="a.tdms",
        write=holding(_tdms_segment([*one[:2], promise], bytes(16))),
        options=RATE,
    )
    meta = struct.pack("<I", 0xFFFFFFFF)
    yield HostileShape(
        name="TDMS, four billion objects",
        file="a.tdms",
        write=holding(b"TDSm" + struct.pack("<IIQQ", 0x0E, 4713, 4, 4) + meta),
        options=RATE,
    )
