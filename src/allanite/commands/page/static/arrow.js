// SPDX-License-Identifier: BSD-3-Clause
// An Arrow stream as columns: doubles as they lie in the buffer, texts as dictionaries with one number a row.
// https://arrow.apache.org/docs/format/Columnar.html; what `fleet_table.py` writes, and no more of the format.

const SCHEMA = 1, DICTIONARY = 2, BATCH = 3;
const DOUBLE = 3, TEXT = 5;

/** A table of a flatbuffer: `field(i)` is where its field stands, 0 where it is absent. */
class Table {
  constructor(view, at) {
    this.view = view;
    this.at = at;
    this.fields = at - view.getInt32(at, true);
  }

  field(i) {
    const slot = 4 + 2 * i;
    if (slot >= this.view.getUint16(this.fields, true)) return 0;
    const offset = this.view.getUint16(this.fields + slot, true);
    return offset ? this.at + offset : 0;
  }

  behind(at) {
    return at + this.view.getUint32(at, true);
  }

  table(i) {
    const at = this.field(i);
    return at ? new Table(this.view, this.behind(at)) : null;
  }

  byte(i) {
    const at = this.field(i);
    return at ? this.view.getUint8(at) : 0;
  }

  long(i) {
    const at = this.field(i);
    return at ? Number(this.view.getBigInt64(at, true)) : 0;
  }

  text(i) {
    const at = this.behind(this.field(i));
    return new TextDecoder().decode(new Uint8Array(this.view.buffer, this.view.byteOffset + at + 4, this.view.getUint32(at, true)));
  }

  /** Where a vector begins, and how many it holds. */
  vector(i) {
    const at = this.field(i);
    if (!at) return [0, 0];
    const start = this.behind(at);
    return [start + 4, this.view.getUint32(start, true)];
  }
}

/** The messages of a stream: kind, header, and where the body begins. */
function* messages(buffer) {
  const view = new DataView(buffer);
  let at = 0;
  while (at + 8 <= buffer.byteLength) {
    const length = view.getInt32(at + 4, true);
    if (view.getUint32(at, true) !== 0xffffffff || length < 0) throw new Error("not an Arrow stream");
    if (length === 0) return;
    const root = at + 8 + view.getUint32(at + 8, true);
    const message = new Table(view, root);
    const body = at + 8 + length;
    yield { kind: message.byte(1), header: message.table(2), body };
    at = body + message.long(3);
  }
}

/** The buffers of a batch: [where, bytes]. */
function buffersOf(batch, body) {
  const [start, count] = batch.vector(2);
  return Array.from({ length: count }, (_, i) => [
    body + Number(batch.view.getBigInt64(start + 16 * i, true)),
    Number(batch.view.getBigInt64(start + 16 * i + 8, true)),
  ]);
}

function texts(buffer, count, [offsetsAt], [dataAt]) {
  const offsets = new Int32Array(buffer, offsetsAt, count + 1);
  const decoder = new TextDecoder();
  return Array.from({ length: count }, (_, i) => decoder.decode(new Uint8Array(buffer, dataAt + offsets[i], offsets[i + 1] - offsets[i])));
}

function fieldsOf(schema) {
  const [start, count] = schema.vector(1);
  return Array.from({ length: count }, (_, i) => {
    const field = new Table(schema.view, schema.behind(start + 4 * i));
    const encoding = field.table(4);
    return { name: field.text(0), type: field.byte(2), dictionary: encoding ? encoding.long(0) : null };
  });
}

/**
 * Read a stream: { rows, columns }, a column being { values: Float64Array } or { codes: Int32Array, words: [text] }.
 */
export function arrowTable(buffer) {
  let fields = [], rows = 0;
  const dictionaries = new Map(), columns = {};
  for (const { kind, header, body } of messages(buffer)) {
    if (kind === SCHEMA) {
      fields = fieldsOf(header);
    } else if (kind === DICTIONARY) {
      const data = header.table(1);
      const [, offsets, bytes] = buffersOf(data, body);
      dictionaries.set(header.long(0), data.long(0) ? texts(buffer, data.long(0), offsets, bytes) : []);
    } else if (kind === BATCH) {
      rows = header.long(0);
      const buffers = buffersOf(header, body);
      fields.forEach((field, i) => {
        const [at] = buffers[2 * i + 1];
        if (field.dictionary !== null && field.type === TEXT) columns[field.name] = { codes: new Int32Array(buffer, at, rows), words: dictionaries.get(field.dictionary) };
        else if (field.type === DOUBLE) columns[field.name] = { values: new Float64Array(buffer, at, rows) };
        else throw new Error(`column ${field.name} has a type that this page does not read`);
      });
    }
  }
  return { rows, columns };
}
