# SPDX-License-Identifier: BSD-3-Clause
"""Flight logs, recordings of ROS, spreadsheets."""

from __future__ import annotations

import sqlite3
import struct
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from tests import flight_log_writers as logs
from tests import ros_writers as ros
from tests import spreadsheet_writers as sheets
from tests.hostile_shapes.shape import DIGITS, RATE, HostileShape, Write, holding, zipped

# -- flight logs -------------------------------------------------------------------------------------------


def flight_logs(wide: int) -> Iterator[HostileShape]:
    head = logs.ulog_header()
    rows = b"".join(logs.combined(1, 10**7 + 4000 * k, (1, 2, 3), (4, 5, 6)) for k in range(20))
    known = logs.definition("sensor_combined", logs.SENSOR_COMBINED) + logs.subscription(1, "sensor_combined")
    nested = b"".join(logs.definition(f"n{k}", f"n{k + 1} a;n{k + 1} b;") for k in range(30))
    leaf = logs.definition("n30", "uint8_t a;")
    ulog = {
        "formats": head
        + b"".join(logs.definition(f"f{k}", "uint64_t timestamp;") for k in range(wide))
        + known
        + rows,
        "subscriptions": head
        + known
        + b"".join(logs.subscription(k % 65000, "sensor_combined", k % 256) for k in range(2, 8 * wide))
        + rows,
        "instances with a message each": head
        + known
        + b"".join(
            logs.subscription(k, "sensor_combined", k % 256)
            + logs.combined(k, 10**7 + k, (1, 2, 3), (4, 5, 6))
            for k in range(2, wide)
        ),
        "types that double 30 times": head
        + nested
        + leaf
        + logs.definition("sensor_gyro", "uint64_t timestamp;n0 x;")
        + logs.subscription(1, "sensor_gyro")
        + logs.data(1, "Q", 5),
        "a type that holds itself": head
        + logs.definition("sensor_gyro", "uint64_t timestamp;sensor_gyro x;")
        + logs.subscription(1, "sensor_gyro")
        + logs.data(1, "Q", 5),
        "an array of two billion": head
        + logs.definition("sensor_gyro", "uint64_t timestamp;float[2000000000] x;")
        + logs.subscription(1, "sensor_gyro")
        + logs.data(1, "Q", 5),
        "fields": head
        + logs.definition("sensor_gyro", "uint64_t timestamp;" + "uint8_t a;" * 5500)
        + logs.subscription(1, "sensor_gyro")
        + logs.data(1, "Q", 5),
        "bytes missing in its definitions": head + known[:40] + struct.pack("<HB", 0xFFFF, 0) + b"12345",
        "dropouts": head + known + rows + logs.dropout(3) * (20 * wide),
    }
    for name, content in ulog.items():
        yield HostileShape(name=f"ULog, many {name}", file="a.ulg", write=holding(content))
    first = logs.FMT_ITSELF + logs.fmt(*logs.IMU)
    body = b"".join(logs.imu(10_000 * k, 0, (1, 2, 3), (4, 5, 6)) for k in range(30))
    many = b"".join(
        logs.fmt(k % 256, f"M{k % 100}", "Q" * 16, ",".join("abcdefghijklmnop")) for k in range(8 * wide)
    )
    instances = b"".join(logs.imu(10_000 * k, k % 256, (1, 2, 3), (4, 5, 6)) for k in range(wide))
    ardupilot = {
        "definitions": first + many + first + body,
        "instances": first + instances,
        "beginnings of records": first + body + b"\xa3\x95" * (40 * wide),
        "definitions of zero length": first + logs.fmt(200, "ZERO", "", "", 0) * wide + body,
    }
    for name, content in ardupilot.items():
        yield HostileShape(name=f"ArduPilot, many {name}", file="a.BIN", write=holding(content))


# -- ROS ---------------------------------------------------------------------------------------------------


def _doubling(depth: int) -> str:
    """A definition of types each of which holds the next one twice."""
    line = "=" * 80
    parts = ["p/T0 a\np/T0 b\n"]
    parts += [f"MSG: p/T{k}\np/T{k + 1} a\np/T{k + 1} b\n" for k in range(depth)]
    parts.append(f"MSG: p/T{depth}\nsensor_msgs/Imu imu\n")
    return f"{line}\n".join(parts)


def _bag_record(fields: dict[str, bytes], data: bytes) -> bytes:
    head = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v for k, v in fields.items())
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


def _bag_connection(key: int, topic: str, kind: str, definition: str) -> bytes:
    fields = {"topic": topic.encode(), "type": kind.encode(), "md5sum": b"0" * 32}
    fields["message_definition"] = definition.encode()
    data = b"".join(struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v for k, v in fields.items())
    return _bag_record({"op": b"\x07", "conn": struct.pack("<I", key), "topic": topic.encode()}, data)


def _bag(*connections: bytes, chunks: int = 1) -> bytes:
    begin = b"#ROSBAG V2.0\n" + _bag_record(
        {"op": b"\x03", "index_pos": bytes(8), "conn_count": bytes(4), "chunk_count": bytes(4)}, bytes(64)
    )
    inner = b"".join(connections)
    chunk = _bag_record({"op": b"\x05", "compression": b"none", "size": struct.pack("<I", len(inner))}, inner)
    empty = _bag_record({"op": b"\x05", "compression": b"none", "size": bytes(4)}, b"")
    return begin + chunk + empty * (chunks - 1)


_PLAIN = "float64 a\nfloat64 b\n"


def bags(wide: int) -> Iterator[HostileShape]:
    one = [_bag_connection(k, f"/t{k}", "p/T", _PLAIN) for k in range(wide)]
    own = [_bag_connection(k, f"/t{k}", f"p/T{k}", f"{_PLAIN}float64 c{k}\n") for k in range(wide)]
    line = "=" * 80
    table = {
        "too many connections": (_bag(*one), "topics"),
        "too many types": (_bag(*own), "topics"),
        "types that double 40 times": (_bag(_bag_connection(0, "/a", "p/M", _doubling(40))), "Imu"),
        "types that double 5 times": (_bag(_bag_connection(0, "/a", "p/M", _doubling(5))), ""),
        "a type that holds itself": (
            _bag(_bag_connection(0, "/a", "p/M", f"p/M a\np/M b\n{line}\nMSG: p/M\np/M a\np/M b\n")),
            "Imu",
        ),
        "types nested 2000 deep": (
            _bag(
                _bag_connection(
                    0,
                    "/a",
                    "p/M",
                    f"p/T0 a\n{line}\n"
                    + f"{line}\n".join(f"MSG: p/T{k}\np/T{k + 1} a\n" for k in range(2000)),
                )
            ),
            "Imu",
        ),
        "a definition of a megabyte": (
            _bag(_bag_connection(0, "/a", "p/M", "".join(f"float64 a{k}\n" for k in range(70_000)))),
            "",
        ),
        "100 000 empty chunks": (_bag(one[0], chunks=20 * wide), "Imu"),
    }
    for name, (content, says) in table.items():
        yield HostileShape(name=f"ROS 1 bag, {name}", file="a.bag", write=holding(content), says=says)


_SCHEMA = """
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
"""


def _sqlite(fill: Callable[[sqlite3.Connection], Any], schema: str = _SCHEMA) -> Write:
    def write(path: Path) -> None:
        base = sqlite3.connect(path)
        base.executescript(schema)
        fill(base)
        base.commit()
        base.close()

    return write


def _many_topics(count: int) -> Callable[[sqlite3.Connection], Any]:
    rows = [(k, f"/t{k}", "sensor_msgs/msg/Imu", "cdr", "") for k in range(count)]
    return lambda base: base.executemany("INSERT INTO topics VALUES (?,?,?,?,?)", rows)


def _many_tables(count: int, what: str) -> Callable[[sqlite3.Connection], Any]:
    def fill(base: sqlite3.Connection) -> None:
        for k in range(count):
            base.execute(what.format(k))

    return fill


_ENDLESS = """
CREATE VIEW {} AS WITH RECURSIVE endless(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM endless)
SELECT id, 1 AS topic_id, id AS timestamp, x'00' AS data, 'a' AS name, 'b' AS type, 'cdr' AS serialization_format
FROM endless;
"""


def ros2(wide: int) -> Iterator[HostileShape]:
    table: dict[str, tuple[Write, str]] = {
        "too many topics": (_sqlite(_many_topics(wide)), "topics"),
        "many tables": (_sqlite(_many_tables(wide // 10, "CREATE TABLE x{}(a)")), "Imu"),
        "many triggers": (
            _sqlite(
                _many_tables(
                    wide // 10, "CREATE TRIGGER x{} AFTER INSERT ON topics BEGIN DELETE FROM messages; END"
                )
            ),
            "",
        ),
        "a view without end for messages": (
            _sqlite(
                lambda base: base.executescript(_ENDLESS.format("messages")),
                _SCHEMA.split(";")[0] + ";",
            ),
            "not a ROS 2 recording",
        ),
        "a view without end for definitions": (
            _sqlite(
                lambda base: base.executescript(
                    "INSERT INTO topics VALUES (1,'/imu','sensor_msgs/msg/Imu','cdr','');"
                    + _ENDLESS.format("message_definitions")
                )
            ),
            "",
        ),
        "a column that is calculated without end": (
            _sqlite(
                lambda base: base.execute("INSERT INTO topics(id, name) VALUES (1, '/imu')"),
                "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT GENERATED ALWAYS AS "
                "(hex(zeroblob(200000000))), serialization_format TEXT);" + _SCHEMA.split(";")[1] + ";",
            ),
            "",
        ),
        "keys that are texts": (
            _sqlite(
                lambda base: base.execute("INSERT INTO topics VALUES ('a','/imu','b','cdr','')"),
                _SCHEMA.replace("INTEGER PRIMARY KEY", "TEXT"),
            ),
            "",
        ),
    }
    for name, (write, says) in table.items():
        yield HostileShape(name=f"ROS 2 SQLite, {name}", file="a.db3", write=write, says=says)
    imu = ros.schema(1, "p/msg/T", _PLAIN)
    mcap = {
        "schemas": b"".join(
            ros.schema(k % 65000 + 1, f"p/msg/T{k}", f"{_PLAIN}float64 c{k}\n") for k in range(wide)
        )
        + b"".join(ros.channel(k, k % 65000 + 1, f"/t{k}") for k in range(wide)),
        "channels": imu + b"".join(ros.channel(k, 1, f"/t{k}") for k in range(wide)),
        "chunks": imu + ros.channel(1, 1, "/a") + ros.chunk(b"") * (20 * wide),
        "attachments": imu + ros.channel(1, 1, "/a") + ros.record(9, bytes(40)) * (20 * wide),
    }
    for name, content in mcap.items():
        says = "topics" if name in ("schemas", "channels") else "Imu"
        yield HostileShape(
            name=f"MCAP, many {name}", file="a.mcap", write=holding(ros.mcap(content)), says=says
        )
    doubling = ros.schema(1, "p/msg/M", _doubling(40).replace("p/", "p/msg/").replace("msgs/I", "msgs/msg/I"))
    yield HostileShape(
        name="MCAP, types that double 40 times",
        file="a.mcap",
        write=holding(ros.mcap(doubling + ros.channel(1, 1, "/a"))),
        says="Imu",
    )


# -- spreadsheets ------------------------------------------------------------------------------------------


def _sheet_with(part: str, tail: str = "") -> Write:
    """A workbook whose only sheet holds this text."""

    def write(path: Path) -> None:
        sheets.xlsx(path, {"a": []})
        with zipfile.ZipFile(path) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        name = "xl/worksheets/sheet1.xml"
        main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
        members[name] = f'<worksheet xmlns="{main}">{part}{tail}</worksheet>'.encode()
        zipped(path, members)

    return write


_NUMBERS = "".join(f'<row r="{k}"><c r="A{k}"><v>{k}.5</v></c></row>' for k in range(1, 40))


def spreadsheets(wide: int) -> Iterator[HostileShape]:
    merged = "".join(f'<mergeCell ref="A{k}:B{k}"/>' for k in range(1, 10 * wide))
    rows = f"<sheetData>{_NUMBERS}</sheetData>"
    far = '<row r="1048576"><c r="XFD1048576"><v>1</v></c></row>'
    entities = (
        '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">'
        + "".join(f'<!ENTITY {chr(98 + k)} "{("&" + chr(97 + k) + ";") * 10}">' for k in range(9))
        + "]>"
    )

    def bomb(path: Path) -> None:
        _sheet_with(f'<sheetData><row r="1"><c r="A1" t="str"><v>&j;</v></c></row>{_NUMBERS}</sheetData>')(
            path
        )
        with zipfile.ZipFile(path) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        name = "xl/worksheets/sheet1.xml"
        members[name] = entities.encode() + members[name]
        zipped(path, members)

    table: dict[str, tuple[Write, str]] = {
        "too many columns": (lambda p: sheets.xlsx(p, {"a": [[1.5] * wide] * 3}), "columns"),
        "too many sheets": (
            lambda p: sheets.xlsx(p, {f"s{k}": [[1.5, 2.5]] * 3 for k in range(wide // 10)}),
            "sheets",
        ),
        "a dimension of all cells": (
            _sheet_with('<dimension ref="A1:XFD1048576"/>' + rows),
            "",
        ),
        "one cell in the last corner": (
            _sheet_with(f"<sheetData>{_NUMBERS}{far}</sheetData>"),
            "cells|memory|columns",
        ),
        "many merged cells": (_sheet_with(rows, f"<mergeCells>{merged}</mergeCells>"), ""),
        "entities that multiply": (bomb, ""),
        "elements 60 000 deep": (_sheet_with("<sheetData>" + "<a>" * 60_000), ""),
        "number of 5000 digits": (
            _sheet_with(f'<sheetData>{_NUMBERS}<row r="40"><c r="A40"><v>{DIGITS}</v></c></row></sheetData>'),
            "",
        ),
        "row number of 5000 digits": (
            _sheet_with(f'<sheetData><row r="{DIGITS}"><c r="A{DIGITS}"><v>1</v></c></row></sheetData>'),
            "",
        ),
    }
    for name, (write, says) in table.items():
        yield HostileShape(name=f"spreadsheet, {name}", file="a.xlsx", write=write, says=says, options=RATE)
    repeated = (
        '<table:table-cell table:number-columns-repeated="16384" office:value-type="float" office:value="1"/>'
    )

    def wide_ods(path: Path) -> None:
        sheets.ods(path, {"a": [[1.5, 2.5]] * 3})
        with zipfile.ZipFile(path) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        text = members["content.xml"].decode()
        cell = f'<table:table-row table:number-rows-repeated="1048576">{repeated}</table:table-row>'
        members["content.xml"] = text.replace("</table:table>", cell + "</table:table>").encode()
        zipped(path, members)

    yield HostileShape(
        name="spreadsheet, cells repeated 16384 x 1048576 times",
        file="a.ods",
        write=wide_ods,
        says="memory|columns|cells",
        options=RATE,
    )
