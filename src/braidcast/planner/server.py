"""The planner's server: the page, what it starts with, and the simulations it asks for.

Whoever opens the page may use it, nobody else: a page of another site cannot, because its
requests lack the session's header, and cannot pretend to be ours by a name that leads here,
because only the names of this machine are answered.
"""

from __future__ import annotations

import asyncio
import json
import mimetypes
import re
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from braidcast.errors import InputError
from braidcast.planner.contents import Contents, Packed
from braidcast.planner.jobs import Job, Jobs, Simulate, TooMany
from braidcast.planner.pages import STATIC, policy
from braidcast.planner.simulation import simulate_apart

LARGEST_BODY = 100_000

_LOOPBACK = {"localhost", "127.0.0.1", "::1"}
_SESSION = re.compile(r"[A-Za-z0-9_-]{8,64}")

# Some systems call a module a plain text, which no browser then runs.
mimetypes.add_type("text/javascript", ".js")


def application(
    contents: Contents,
    *,
    any_host: bool = False,
    simulate: Simulate = simulate_apart,
    static: Path = STATIC,
) -> Starlette:
    """The server of a planner. ``any_host``: whatever name the browser knows it by."""
    page = (static / "index.html").read_text("utf-8").replace('"./', '"./static/')
    api = _Api(contents, Jobs(simulate))
    return Starlette(
        routes=[
            Route("/", lambda request: HTMLResponse(page)),
            Mount("/static", StaticFiles(directory=static)),
            Route("/api/start", api.start),
            Route("/api/model", api.model),
            Route("/api/alive", api.alive),
            Route("/api/jobs", api.add, methods=["POST"]),
            Route("/api/jobs/{id}", api.status, methods=["GET"]),
            Route("/api/jobs/{id}", api.cancel, methods=["DELETE"]),
            Route("/api/jobs/{id}/result", api.result),
        ],
        middleware=[
            Middleware(_Guard, policy=policy(page), any_host=any_host),
            Middleware(GZipMiddleware, minimum_size=1000, compresslevel=6),
        ],
        exception_handlers={
            HTTPException: _refused,
            InputError: lambda request, error: _error(422, str(error)),
            TooMany: lambda request, error: _error(429, str(error)),
            Exception: lambda request, error: _error(500, "the server failed; its log says how"),
        },
        lifespan=api.lifespan,
    )


class _Api:
    def __init__(self, contents: Contents, jobs: Jobs) -> None:
        self._contents, self._jobs = contents, jobs
        self._identity = secrets.token_hex(8)

    @asynccontextmanager
    async def lifespan(self, app: Starlette) -> AsyncIterator[None]:
        """Get everything ready while the page loads; end what simulates with the server."""
        self._ready = asyncio.create_task(run_in_threadpool(self._prepared))
        work = asyncio.create_task(self._jobs.work())
        try:
            yield
        finally:
            work.cancel()
            with suppress(asyncio.CancelledError):
                await work
            await asyncio.wait([self._ready])

    def _prepared(self) -> tuple[Packed, Packed | None]:
        return self._contents.start, self._contents.model

    async def start(self, request: Request) -> Response:
        return _packed(request, (await asyncio.shield(self._ready))[0], "application/json")

    async def model(self, request: Request) -> Response:
        model = (await asyncio.shield(self._ready))[1]
        if model is None:
            raise HTTPException(404, "there is no model for this case")
        return _packed(request, model, "application/octet-stream")

    async def alive(self, request: Request) -> Response:
        return _json({"started": self._identity})

    async def add(self, request: Request) -> Response:
        session, tables = _session(request), _case(await _body(request))
        case = await run_in_threadpool(self._contents.opened.posted, tables)
        job = self._jobs.add(session, case.to_dict())
        return _json(self._jobs.status(job), 202)

    async def status(self, request: Request) -> Response:
        return _json(self._jobs.status(self._job(request)))

    async def cancel(self, request: Request) -> Response:
        job = self._job(request)
        self._jobs.cancel(job)
        return _json(self._jobs.status(job))

    async def result(self, request: Request) -> Response:
        job = self._job(request)
        if job.result is None:
            raise HTTPException(409, f"the simulation is {job.state}, must be done for a result")
        return Response(job.result, media_type="application/octet-stream")

    def _job(self, request: Request) -> Job:
        job = self._jobs.find(_session(request), request.path_params["id"])
        if job is None:
            raise HTTPException(
                404, "there is no such simulation of this page, or it is no longer kept"
            )
        return job


def _session(request: Request) -> str:
    session = request.headers.get("x-braidcast-session", "")
    if not _SESSION.fullmatch(session):
        raise HTTPException(
            400, "the header X-Braidcast-Session must be 8 to 64 letters, digits, - or _"
        )
    return session


async def _body(request: Request) -> bytes:
    """The body, if it is small; what is too much is read and forgotten, up to a point."""
    kept, length = b"", 0
    async for chunk in request.stream():
        length += len(chunk)
        if length <= LARGEST_BODY:
            kept += chunk
        elif length > 100 * LARGEST_BODY:
            break
    if length > LARGEST_BODY:
        raise HTTPException(413, f"the request is longer than {LARGEST_BODY} bytes")
    return kept


def _case(body: bytes) -> dict[str, Any]:
    try:
        posted = json.loads(body)
    except (ValueError, RecursionError):
        raise HTTPException(400, "the request is not JSON") from None
    if not isinstance(posted, dict) or not isinstance(posted.get("case"), dict):
        raise HTTPException(400, 'the request must be {"case": tables of a case}')
    return posted["case"]


def _packed(request: Request, content: Packed, media_type: str) -> Response:
    if "gzip" in request.headers.get("accept-encoding", ""):
        headers = {"Content-Encoding": "gzip", "Vary": "Accept-Encoding"}
        return Response(content.gzipped, media_type=media_type, headers=headers)
    return Response(content.plain, media_type=media_type)


def _json(content: Any, status: int = 200) -> Response:
    # ASCII: what somebody sent may come back, and not all of it need be valid Unicode.
    return Response(json.dumps(content), status, media_type="application/json")


def _error(status: int, sentence: str) -> Response:
    return _json({"error": sentence}, status)


def _refused(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    response = _error(error.status_code, error.detail)
    response.headers.update(error.headers or {})
    return response


class _Guard:
    """Answers only to this machine's names, and says what the page may do."""

    def __init__(self, app: ASGIApp, policy: str, any_host: bool) -> None:
        self._app, self._any_host = app, any_host
        self._headers = {
            "Content-Security-Policy": policy,
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Cross-Origin-Resource-Policy": "same-origin",
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                headers.update(self._headers)
                headers.setdefault("Cache-Control", "no-cache")
            await send(message)

        app = self._app if self._any_host or _is_loopback(scope) else _wrong_host
        await app(scope, receive, send_with_headers)


def _is_loopback(scope: Scope) -> bool:
    hosts = [value for name, value in scope["headers"] if name == b"host"]
    try:
        return len(hosts) == 1 and urlsplit(f"//{hosts[0].decode()}").hostname in _LOOPBACK
    except ValueError:
        return False


async def _wrong_host(scope: Scope, receive: Receive, send: Send) -> None:
    sentence = "the planner answers to localhost, 127.0.0.1 and [::1] only"
    await _error(403, sentence)(scope, receive, send)
