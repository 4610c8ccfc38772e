// SPDX-License-Identifier: BSD-3-Clause
// Requests to the server of this page. Every answer is JSON; a refusal becomes an error that says what to do.

const csrf = () => document.querySelector('meta[name="csrf-token"]').content;

/** What the server refused, in its own words. */
export class Refused extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

const ENDED = "This page belongs to a server that has ended: open the address that `allanite serve` printed.";

async function answered(request) {
  let reply;
  try {
    reply = await request;
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Refused(0, "The server does not answer. Is `allanite serve` still running?");
  }
  if (reply.status === 401) throw new Refused(401, ENDED);
  if (reply.ok) return reply;
  let message = `The server answered ${reply.status}.`;
  try {
    message = (await reply.json()).error.message;
  } catch {
    // an answer without a sentence: the status has to do
  }
  throw new Refused(reply.status, message);
}

export const get = async (path, options = {}) => (await answered(fetch(path, options))).json();

export async function post(path, body = {}) {
  const headers = { "Content-Type": "application/json", "X-CSRF-Token": csrf() };
  return (await answered(fetch(path, { method: "POST", headers, body: JSON.stringify(body) }))).json();
}

/** Send a dropped file as it is; its name is only shown. */
export async function upload(file) {
  const headers = {
    "Content-Type": "application/octet-stream",
    "X-CSRF-Token": csrf(),
    "X-File-Name": encodeURIComponent(file.name),
  };
  return (await answered(fetch("/api/upload", { method: "POST", headers, body: file }))).json();
}

/** A table: facts, and the buffer of an Arrow stream. */
export async function arrow(path) {
  const reply = await answered(fetch(path));
  return { facts: JSON.parse(decodeURIComponent(reply.headers.get("X-Fleet"))), buffer: await reply.arrayBuffer() };
}

/** Numbers of a window of a series: facts, and one array of 64-bit numbers. */
export async function numbers(path, signal) {
  const reply = await answered(fetch(path, { signal }));
  return { facts: JSON.parse(reply.headers.get("X-Series")), values: new Float64Array(await reply.arrayBuffer()) };
}
