# SPDX-License-Identifier: BSD-3-Clause
"""The routes of the page: each looks up an id, asks one part of this package, and answers with plain data."""

from __future__ import annotations

import asyncio
import json
import secrets
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from functools import wraps
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from allanite import __version__
from allanite.commands.page.attached import Attached
from allanite.commands.page.bounds import is_inside, own_folder, read_inside
from allanite.commands.page.captures import Captures, described_instruments
from allanite.commands.page.catalogue import Catalogue, health_of
from allanite.commands.page.children import Quick
from allanite.commands.page.events import Streams
from allanite.commands.page.guard import Guard
from allanite.commands.page.jobs import Job, Jobs
from allanite.commands.page.kinds import described_kinds
from allanite.commands.page.live import Live
from allanite.commands.page.options import READING, checked, described, given_in
from allanite.commands.page.replies import Refused, body_of, download, plain, refusal
from allanite.commands.page.settings import RESULTS, Settings
from allanite.commands.page.static_files import StaticFiles
from allanite.commands.page.store import SeriesStore
from allanite.commands.page.uploads import receive
from allanite.commands.page.work import Work, path_word, planned, with_layout, work_of
from allanite.errors import AllaniteError
from allanite.stability.fleet.table_files import TABLE

__all__ = ["Application"]

Json = Mapping[str, Any]
Handler = Callable[["Application", Request], Awaitable[Response]]

_VIEW_OPTIONS = ("view", "channel")


def _answering(handler: Handler) -> Handler:
    """Refusals as answers."""

    @wraps(handler)
    async def answered(self: Application, request: Request) -> Response:
        try:
            return await handler(self, request)
        except Refused as refused:
            return refusal(refused.status, str(refused))
        except AllaniteError as error:
            return refusal(400, str(error))

    return answered


class Application:
    """What is behind the routes.

    Parameters
    ----------
    settings : Settings
    ready : callable, optional
        Told when requests will be answered.

    Attributes
    ----------
    ending : callable
        Whether the server is about to end: streams end then, for it waits for them.
    """

    def __init__(self, settings: Settings, *, ready: Callable[[], None] | None = None) -> None:
        self.settings = settings
        self._ready = ready
        self.catalogue = Catalogue(settings)
        self.series = SeriesStore(settings)
        self.attached = Attached(settings.instruments, settings.limits.listing)
        self.captures = Captures(settings, self.catalogue, self.attached)
        self.streams = Streams(settings.limits.streams)
        self.live = Live(settings.limits)
        self.quick = Quick(settings.limits.quick)
        self.static = StaticFiles(settings)
        self.jobs = Jobs(settings.limits, self._finished)
        self._waiting = ThreadPoolExecutor(settings.limits.waiting, "waits for a child")
        self.ending: Callable[[], bool] = lambda: False
        self._submitting = threading.Lock()
        self._results = 0
        self.app = Starlette(
            routes=self._routes(),
            middleware=[Middleware(Guard, settings=settings)],
            exception_handlers={HTTPException: _no_such, Exception: _broken},
            lifespan=self._lifespan,
        )

    def close(self) -> None:
        """End everything that was started, except recorders."""
        self.ending = lambda: True
        self.live.close()
        self.jobs.close()
        self.quick.close()
        self._waiting.shutdown(wait=False, cancel_futures=True)

    @asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        self.settings.cache.mkdir(parents=True, exist_ok=True, mode=0o700)
        await run_in_threadpool(self.catalogue.scan)
        if self.settings.limits.ahead:
            await run_in_threadpool(self.jobs.prepare)
            await run_in_threadpool(self.quick.prepare)
        if self._ready is not None:
            self._ready()
        yield
        await run_in_threadpool(self.close)

    def _routes(self) -> list[Route]:
        table: list[tuple[str, str, Handler]] = [
            ("GET", "/", Application.page),
            ("GET", "/static/{name}", Application.file),
            ("GET", "/api/session", Application.session),
            ("GET", "/api/catalogue", Application.list_files),
            ("POST", "/api/upload", Application.upload),
            ("POST", "/api/recordings/{id}/open", Application.open_recording),
            ("POST", "/api/recordings/{id}/list", Application.list_recording),
            ("GET", "/api/recordings/{id}/fleet", Application.fleet),
            ("GET", "/api/series/{id}", Application.series_facts),
            ("GET", "/api/series/{id}/window", Application.window),
            ("GET", "/api/jobs", Application.list_jobs),
            ("POST", "/api/jobs", Application.start_job),
            ("POST", "/api/jobs/preview", Application.preview_job),
            ("GET", "/api/jobs/events", Application.job_events),
            ("GET", "/api/jobs/{id}", Application.job),
            ("POST", "/api/jobs/{id}/cancel", Application.cancel_job),
            ("GET", "/api/jobs/{id}/document", Application.job_document),
            ("GET", "/api/jobs/{id}/files/{index}", Application.job_file),
            ("GET", "/api/documents/{id}", Application.document),
            ("GET", "/api/documents/{id}/figure", Application.figure),
            ("GET", "/api/documents/{id}/parameters", Application.parameters),
            ("GET", "/api/documents/{id}/said", Application.said),
            ("GET", "/api/documents/{id}/report", Application.report),
            ("GET", "/api/documents/{id}/files/{index}", Application.document_file),
            ("POST", "/api/plan", Application.plan),
            ("GET", "/api/instruments", Application.list_instruments),
            ("GET", "/api/captures", Application.list_captures),
            ("POST", "/api/captures", Application.start_capture),
            ("POST", "/api/captures/{id}/stop", Application.stop_capture),
            ("GET", "/api/runs/{id}/events", Application.run_events),
            ("GET", "/api/runs/{id}/figure", Application.run_figure),
        ]
        return [Route(path, self._bound(handler), methods=[method]) for method, path, handler in table]

    async def _body(self, request: Request) -> dict[str, Any]:
        limits = self.settings.limits
        return await body_of(request, most=limits.body, seconds=limits.request)

    async def _waited(self, work: Callable[..., Any], *given: Any) -> Any:
        """Do what waits for a child process, in threads that no other request needs."""
        return await asyncio.get_running_loop().run_in_executor(self._waiting, work, *given)

    def _bound(self, handler: Handler) -> Callable[[Request], Awaitable[Response]]:
        async def endpoint(request: Request) -> Response:
            return await handler(self, request)

        return endpoint

    # -- the page ---------------------------------------------------------------------------------------------

    @_answering
    async def page(self, request: Request) -> Response:
        return self.static.page()

    @_answering
    async def file(self, request: Request) -> Response:
        response = self.static.file(request)
        if response is None:
            raise Refused(404, "no such file")
        return response

    @_answering
    async def session(self, request: Request) -> Response:
        return plain(await run_in_threadpool(self._session))

    def _session(self) -> Json:
        from allanite.exporters import EXPORTERS, exporter, options_of
        from allanite.recording.health.catalogue import CATALOGUE

        limits = self.settings.limits
        consumers = [exporter(name.replace("_", "-")) for name in EXPORTERS]
        return {
            "version": __version__,
            "csrf": self.settings.csrf,
            "folder": self.settings.folder.name,
            "upload_limit": limits.upload,
            "workers": limits.workers,
            "queue_limit": limits.queue,
            "writable": self.settings.writable,
            "kinds": described_kinds(),
            "reading": described(READING),
            "instruments": described_instruments(),
            "consumers": [
                {"name": c.NAME, "file": c.FILE_NAME, "summary": c.SUMMARY, "takes": c.TAKES, "options": options_of(c)}
                for c in consumers
            ],
            "findings": sorted(CATALOGUE),
        }  # fmt: skip

    # -- files ------------------------------------------------------------------------------------------------

    @_answering
    async def list_files(self, request: Request) -> Response:
        return plain(await run_in_threadpool(self.catalogue.scan))

    @_answering
    async def upload(self, request: Request) -> Response:
        path = await receive(request, self.settings)
        try:
            return plain({"recording": await run_in_threadpool(self.catalogue.add, path)}, 201)
        except Refused as refused:
            task = {
                "task": "attempt",
                "log": path_word(path, self.settings),
                "cwd": str(self.settings.folder),
            }
            try:
                answer = await self._waited(self.quick.ask, task)
            finally:
                path.unlink(missing_ok=True)
            words = str(answer.get("message", ""))
            raise Refused(400, words.removeprefix(f"{path.name}: ") or str(refused)) from None

    @_answering
    async def list_recording(self, request: Request) -> Response:
        """List a recording, or leave it out of the list; its file stays."""
        body = await self._body(request)
        return plain(await run_in_threadpool(self._list, request.path_params["id"], body.get("listed")))

    def _list(self, given: str, listed: object) -> Json:
        if not isinstance(listed, bool):
            raise Refused(400, "listed is yes or no (true, false)")
        self.catalogue.keep(
            self.catalogue.recording(given).identity, "removed", {} if listed else {"removed": True}
        )
        return self.catalogue.scan()

    # -- series -----------------------------------------------------------------------------------------------

    @_answering
    async def open_recording(self, request: Request) -> Response:
        body = await self._body(request)
        return await run_in_threadpool(self._open, request.path_params["id"], body)

    def _open(self, given: str, body: Json) -> Response:
        recording = self.catalogue.recording(given)
        self._fresh(recording.path)
        recording = self.catalogue.recording(given)
        spelt = checked(READING, given_in(body, "read"), _no_place)
        key = self.series.key(recording, dict(spelt.arguments))
        if self.series.ready(key):
            self.catalogue.keep(recording.identity, "facts", self.series.facts(key))
            return plain({"ready": True, "series": self.series.meta(key)})
        with self._submitting:
            job = self.jobs.running("open", key)
            if job is None:
                self.series.make_room()
                word = path_word(recording.path, self.settings)
                asked, spelt = dict(spelt.arguments), with_layout(spelt, recording.layout, self.settings)
                lines = "from allanite.commands import read_part\n\nrecording = read_part"
                arguments = "".join(f", {k}={v!r}" for k, v in spelt.arguments.items())
                task = {
                    "task": "series", "key": key, "log": word, "cwd": str(self.settings.folder),
                    "folder": str(self.series.folder(key)), "read": dict(spelt.arguments), "given": asked,
                }  # fmt: skip
                job = self.jobs.submit(
                    Work(
                        kind="open", title=f"Preparing {recording.name}", cwd=self.settings.folder, series=task,
                        argv=("info", word, *spelt.words), recording=recording.id, keep=recording.identity,
                        python=f"{lines}({word!r}{arguments})\n",
                    )
                )  # fmt: skip
        return plain({"ready": False, "job": self._job_json(job)}, 202)

    def _fresh(self, path: Path) -> None:
        """A run that grows, or a file that was replaced, has another identity than at the last look."""
        self.catalogue.scan()

    @_answering
    async def fleet(self, request: Request) -> Response:
        """A coefficient of all logs of a fleet, as an Arrow stream."""
        recording = self.catalogue.recording(request.path_params["id"])
        if recording.path.name != TABLE:
            raise Refused(404, f"{recording.name} is not the table of a fleet")
        stream = self.settings.cache / f"fleet-{secrets.token_hex(8)}.arrow"
        asked = {name: request.query_params.get(name) for name in ("channel", "term")}
        task = {"task": "fleet", "table": str(recording.path), "file": str(stream), **asked}
        try:
            answer = await self._waited(self.quick.ask, task)
            if answer["exit"]:
                raise Refused(
                    400, str(answer.get("message") or answer.get("stderr") or "this cannot be read")
                )
            body = await run_in_threadpool(stream.read_bytes)
        finally:
            stream.unlink(missing_ok=True)
        headers = {"X-Fleet": quote(json.dumps(answer["result"])), "Cache-Control": "no-store"}
        return Response(body, media_type="application/vnd.apache.arrow.stream", headers=headers)

    @_answering
    async def series_facts(self, request: Request) -> Response:
        return plain(await run_in_threadpool(self.series.meta, request.path_params["id"]))

    @_answering
    async def window(self, request: Request) -> Response:
        return await run_in_threadpool(self._window, request)

    def _window(self, request: Request) -> Response:
        pyramid = self.series.get(request.path_params["id"])
        asked = request.query_params
        try:
            text = asked.get("channels")
            channels = (
                [int(c) for c in text.split(",")] if text else list(range(len(pyramid.facts["channels"])))
            )
            start, stop = float(asked.get("from", "0")), asked.get("to")
            blocks = int(asked.get("blocks", "1500"))
            end = None if stop is None else float(stop)
        except ValueError:
            raise Refused(400, "channels, from, to and blocks must be numbers") from None
        kind = asked.get("type", "f8")
        if kind not in ("f4", "f8") or len(channels) > 64:
            raise Refused(400, "type must be f4 or f8, and channels at most 64")
        part = pyramid.window(channels, start, end, blocks=blocks)
        facts = {
            "kind": part.kind, "first": part.first, "size": part.size, "count": part.count, "channels": channels,
            "type": kind, "rate": pyramid.facts["rate"], "samples": pyramid.samples,
        }  # fmt: skip
        body = b"".join(np.ascontiguousarray(v, dtype=f"<{kind}").tobytes() for v in part.values)
        return Response(
            body,
            media_type="application/octet-stream",
            headers={"X-Series": json.dumps(facts), "Cache-Control": "no-store"},
        )

    # -- jobs -------------------------------------------------------------------------------------------------

    @_answering
    async def start_job(self, request: Request) -> Response:
        body = await self._body(request)
        return plain({"job": await run_in_threadpool(self._start, body)}, 202)

    def _start(self, body: Json) -> Json:
        with self._submitting:  # the name of a result is free until its folder is made
            work = work_of(body, self.catalogue, self.settings, self.jobs.folders)
            own_folder(self.settings, RESULTS)
            while True:
                try:
                    return self._job_json(self.jobs.submit(work))
                except FileExistsError:  # another program was faster
                    work = work_of(body, self.catalogue, self.settings, self.jobs.folders)

    @_answering
    async def preview_job(self, request: Request) -> Response:
        body = await self._body(request)
        work = await run_in_threadpool(work_of, body, self.catalogue, self.settings, self.jobs.folders)
        return plain({"command": work.command, "python": work.python})

    @_answering
    async def list_jobs(self, request: Request) -> Response:
        return plain({"jobs": [self._job_json(job) for job in self.jobs.all()]})

    @_answering
    async def job(self, request: Request) -> Response:
        return plain({"job": self._job_json(self.jobs.get(request.path_params["id"]))})

    @_answering
    async def cancel_job(self, request: Request) -> Response:
        job = self.jobs.get(request.path_params["id"])
        await run_in_threadpool(self.jobs.cancel, job)
        return plain({"job": self._job_json(job)})

    @_answering
    async def job_document(self, request: Request) -> Response:
        job = self.jobs.get(request.path_params["id"])
        if job.state != "done":
            raise Refused(409, f"this job is {job.state}: it has no result")
        if job.document is not None:
            return await run_in_threadpool(self._file_json, job.document)
        if not job.output:
            raise Refused(404, "this job writes files, but no document")
        return plain(await run_in_threadpool(json.loads, job.output))

    @_answering
    async def job_file(self, request: Request) -> Response:
        job = self.jobs.get(request.path_params["id"])
        return self._numbered(list(job.files), request.path_params["index"])

    @_answering
    async def job_events(self, request: Request) -> Response:
        state = {"number": -1, "results": self._results}

        def news() -> list[tuple[str, Any]]:
            if state["number"] < 0:
                state["number"] = self.jobs.number
                return [("jobs", {"jobs": [self._job_json(job) for job in self.jobs.all()]})]
            changed = self.jobs.since(state["number"])
            events: list[tuple[str, Any]] = [("job", self._job_json(job)) for job in changed]
            state["number"] = max((job.number for job in changed), default=state["number"])
            if state["results"] != self._results:
                state["results"] = self._results
                events.append(("catalogue", {}))
            return events

        return self.streams.stream(news, over=self.ending)

    def _job_json(self, job: Job) -> Json:
        document = None if job.document is None else self.catalogue.id_of(job.document)
        return self.jobs.to_json(job, document)

    def _finished(self, job: Job) -> None:
        """Keep what a job has found out of its recording, and show its result."""
        work = job.work
        if work.kind in ("open", "check") and work.keep is not None:
            self.catalogue.keep(work.keep, "refused", {"message": job.message} if job.message else {})
        if job.message:
            self._results += 1
            return
        if work.kind == "open" and work.series is not None and work.keep is not None:
            self.catalogue.keep(work.keep, "facts", self.series.facts(work.series["key"]))
        if work.kind == "check" and work.keep is not None:
            document = json.loads(job.output)
            self.catalogue.keep(work.keep, "health", health_of(document["findings"], "check"))
        if work.kind == "characterize" and work.keep is not None and job.document is not None:
            document = json.loads(job.document.read_text(encoding="utf-8"))
            self.catalogue.keep(work.keep, "health", health_of(document["findings"], "study"))
        if job.document is not None:
            self.catalogue.link(job.document, work.recording)
        self.catalogue.scan()
        self._results += 1

    # -- results ----------------------------------------------------------------------------------------------

    @_answering
    async def document(self, request: Request) -> Response:
        document = self.catalogue.document(request.path_params["id"])
        return await run_in_threadpool(self._file_json, document.path)

    def _file_json(self, path: Path) -> Response:
        content = read_inside(path, self.settings, self.settings.limits.document)
        try:
            return plain(json.loads(content))
        except (ValueError, RecursionError):
            raise Refused(400, f"{path.name} is damaged: it is not JSON") from None

    @_answering
    async def figure(self, request: Request) -> Response:
        asked = request.query_params
        task: dict[str, Any] = {
            "task": "figure",
            "document": str(self.catalogue.document(request.path_params["id"]).path),
            "without": _listed(asked.get("without")),
            "options": {k: asked[k] for k in _VIEW_OPTIONS if asked.get(k)},
        }
        if asked.get("channels"):
            task["options"]["channels"] = _listed(asked["channels"])
        if asked.get("models"):
            task["models"] = str(self.catalogue.document(asked["models"]).path)
        return await self._asked(task)

    @_answering
    async def parameters(self, request: Request) -> Response:
        document = self.catalogue.document(request.path_params["id"])
        return await self._asked({"task": "parameters", "document": str(document.path)})

    @_answering
    async def said(self, request: Request) -> Response:
        document = self.catalogue.document(request.path_params["id"])
        only = request.query_params.get("only")
        task = {
            "task": "said",
            "document": str(document.path),
            "only": None if only is None else only.split(","),
        }
        return await self._asked(task)

    async def _asked(self, task: Json, status: int = 400) -> Response:
        answer = await self._waited(self.quick.ask, task)
        if answer["exit"]:
            raise Refused(status, str(answer.get("message") or answer.get("stderr") or "this cannot be done"))
        return plain(answer["result"])

    @_answering
    async def report(self, request: Request) -> Response:
        document = self.catalogue.document(request.path_params["id"])
        files = self.catalogue.files_of(document)
        path = next((p for p in files if p.name == "report.html"), None)
        if path is None:
            raise Refused(404, "this result has no report: start a job of kind report")
        return download(path, f"{document.path.parent.name}-report.html")

    @_answering
    async def document_file(self, request: Request) -> Response:
        document = self.catalogue.document(request.path_params["id"])
        return self._numbered(self.catalogue.files_of(document), request.path_params["index"])

    def _numbered(self, files: list[Path], given: str) -> Response:
        number = int(given) if given.isascii() and given.isdigit() and len(given) < 5 else -1
        if (
            not 0 <= number < len(files)
            or not files[number].is_file()
            or not is_inside(files[number], self.settings)
        ):
            raise Refused(404, "no such file")
        return download(files[number], files[number].name)

    @_answering
    async def plan(self, request: Request) -> Response:
        from allanite.experiments.planning import Plan

        body = await self._body(request)
        task, python = await run_in_threadpool(planned, body, self.catalogue, self.settings)
        answer = await self._waited(self.quick.ask, {**task, "figure": True})
        if answer["exit"]:
            lines = [
                s
                for s in str(answer.get("stderr", "")).splitlines()
                if s and not s.startswith("allanite: note")
            ]
            raise Refused(400, "\n".join(lines).removeprefix("allanite: ") or "this cannot be planned")
        document = json.loads(answer["stdout"])
        result = Plan.from_json(document)
        return plain(
            {
                "document": document,
                "says": result.says,
                "notes": result.notes,
                "figure": answer.get("figure"),
                "command": task["command"],
                "python": python,
            }
        )

    # -- captures ---------------------------------------------------------------------------------------------

    @_answering
    async def list_instruments(self, request: Request) -> Response:
        instruments, note = await self._waited(self.attached.look)
        listed = [
            {"id": i.id, "kind": i.kind, "title": i.title, "described": bool(i.format)} for i in instruments
        ]
        return plain({"instruments": listed, "note": note})

    @_answering
    async def list_captures(self, request: Request) -> Response:
        return plain({"captures": await run_in_threadpool(self.captures.all)})

    @_answering
    async def start_capture(self, request: Request) -> Response:
        body = await self._body(request)
        return plain({"capture": await self._waited(self.captures.start, body)}, 201)

    @_answering
    async def stop_capture(self, request: Request) -> Response:
        capture = self.captures.get(request.path_params["id"])
        await run_in_threadpool(self.captures.stop, capture)
        return plain({"capture": await run_in_threadpool(self.captures.to_json, capture)})

    @_answering
    async def run_events(self, request: Request) -> Response:
        watcher = await run_in_threadpool(self.live.look, await self._run(request))
        state = {"number": 0}

        def news() -> list[tuple[str, Any]]:
            events = watcher.since(state["number"])
            state["number"] = max((n for n, *_ in events), default=state["number"])
            return [(name, data) for _, name, data in events]

        return self.streams.stream(
            news, over=lambda: watcher.over or self.ending(), leave=lambda: self.live.leave(watcher)
        )

    @_answering
    async def run_figure(self, request: Request) -> Response:
        task = {
            "task": "live-curve",
            "run": str(await self._run(request)),
            "channel": request.query_params.get("channel"),
        }
        return await self._asked(task, 409)

    async def _run(self, request: Request) -> Path:
        """The folder of a run; one that has just begun is looked for."""
        given = request.path_params["id"]
        try:
            recording = self.catalogue.recording(given)
        except Refused:
            await run_in_threadpool(self.catalogue.scan)
            recording = self.catalogue.recording(given)
        if recording.format != "run" or not recording.path.is_dir():
            raise Refused(409, "only a run that `allanite record` writes can be followed")
        return recording.path


# -- pieces -----------------------------------------------------------------------------------------------


def _listed(text: str | None) -> list[str]:
    return [part for part in (text or "").split(",") if part][:200]


def _no_place(option: Any, name: str, value: Any) -> str:
    raise Refused(400, f"{name} has no meaning here")


async def _no_such(request: Request, error: Exception) -> Response:
    status = error.status_code if isinstance(error, HTTPException) else 500
    return refusal(status, {404: "no such address", 405: "not with this method"}.get(status, "not possible"))


async def _broken(request: Request, error: Exception) -> Response:
    return refusal(500, f"the server failed: {type(error).__name__}")
