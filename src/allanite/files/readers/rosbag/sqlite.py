# Specification: rosbag2_storage_sqlite3, schema versions 1 to 4; SQLite URI file names.
# SPDX-License-Identifier: BSD-3-Clause
"""SQLite files of ROS 2 (.db3), read-only; no other file is opened, whatever the name or the content says."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, Final

from allanite.errors import FormatError, InputError
from allanite.files.readers.rosbag.storage import Batch, Connection
from allanite.plain_files.regular_file import regular

__all__ = ["MAGIC", "Sqlite"]

MAGIC: Final = b"SQLite format 3\x00"
_ROWS = 4096  # messages that are handed over together
_FORMS: Final = {"ros2msg": "msg", "ros2idl": "idl"}


class Sqlite:
    """A .db3 file.

    Raises
    ------
    InputError
        A database of something else.
    FormatError
        A damaged one.
    """

    def __init__(self, path: Path) -> None:
        self._name = path.name
        self.remarks: list[str] = []
        # As a URI, a name with % or ? would be another file; immutable: no journal beside the file is looked at.
        self._base = sqlite3.connect(f"{regular(path).resolve().as_uri()}?mode=ro&immutable=1", uri=True)
        self._base.text_factory = lambda raw: raw.decode("utf-8", "replace")
        left = path.with_name(path.name + "-wal")
        if left.exists() and left.stat().st_size:
            self.remarks.append(
                f"{left.name} holds messages that are not yet in {path.name}: they are not read; 'sqlite3 "
                "FILE .quit' moves them"
            )
        try:
            self._base.execute("PRAGMA trusted_schema = OFF")
            self.connections = tuple(self._connected())
        except sqlite3.Error as error:
            raise self._damaged(error) from None

    def _damaged(self, error: sqlite3.Error) -> FormatError:
        return FormatError(f"{self._name}: damaged database ({str(error)[:100]})")

    def _connected(self) -> Iterator[Connection]:
        tables = {
            name: str(sql)
            for name, sql in self._base.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'")
        }
        if not {"topics", "messages"} <= set(tables) or any(
            "VIRTUAL" in tables[t].upper() for t in ("topics", "messages")
        ):
            raise InputError(
                f"{self._name}: an SQLite database, but not a ROS 2 recording; its tables: "
                f"{', '.join(map(str, tables)) or 'none'}"
            )
        definitions: dict[str, tuple[str, str]] = {}
        if "message_definitions" in tables:
            rows = self._base.execute(
                "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
            )
            definitions = {str(kind): (_FORMS.get(form, ""), str(text)) for kind, form, text in rows}
        counts: dict[Any, int] = dict(
            self._base.execute("SELECT topic_id, count(*) FROM messages GROUP BY topic_id").fetchall()
        )
        for key, topic, kind, encoding in self._base.execute(
            "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
        ).fetchall():
            form, text = definitions.get(str(kind), ("", ""))
            yield Connection(
                key=int(key),
                topic=str(topic),
                kind=str(kind),
                encoding=str(encoding),
                definition=text,
                form=form,
                count=int(counts.get(key, 0)),
            )

    def close(self) -> None:
        self._base.close()

    def batches(self, keys: Collection[int]) -> Iterator[Batch]:
        try:
            cursor = self._base.execute(
                "SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN (SELECT value FROM json_each(?))",
                [json.dumps(sorted(keys))],
            )
            while rows := cursor.fetchmany(_ROWS):
                batch: Batch = {}
                for key, time, message in rows:
                    if not isinstance(time, int) or not isinstance(message, bytes):
                        raise FormatError(f"{self._name}: a message without time or content")
                    received, messages = batch.setdefault(key, ([], []))
                    received.append(time)
                    messages.append(message)
                yield batch
        except sqlite3.Error as error:
            raise self._damaged(error) from None
