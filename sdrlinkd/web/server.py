"""Serves the page until cancelled."""

import asyncio
import socket
import ssl
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import uvicorn
from fastapi import FastAPI
from nicegui import ui

from sdrlinkd.doors import is_local
from sdrlinkd.errors import UserError, ungrouped
from sdrlinkd.web.floor_plan import FloorPlan
from sdrlinkd.web.guard import Guard
from sdrlinkd.web.page import build_page
from sdrlinkd.web.viewer import Viewer
from sdrlinkd.web.world import World, each_second


@dataclass(frozen=True)
class Options:
    """Where and how the page is served; `token` empty: none is asked for."""

    host: str
    port: int
    token: str = ""
    may_control: bool = False
    certificate: Path | None = None
    key: Path | None = None
    plan: FloorPlan | None = None

    @property
    def is_local(self) -> bool:
        """Whether only programs of this host reach it."""
        return is_local(self.host)

    def check(self) -> None:
        """Raises UserError for files that cannot be used."""
        if (self.certificate is None) != (self.key is None):
            raise UserError("--tls-cert and --tls-key: got one of them; allowed: both, or none")
        if self.certificate is not None and self.key is not None:
            try:
                context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
                context.load_cert_chain(self.certificate, self.key)
            except OSError as error:
                why = error.strerror or "not a certificate and its key"
                raise UserError(f"--tls-cert {self.certificate}: {why}") from None


Feed = Callable[[], Coroutine[Any, Any, None]]


async def serve(
    options: Options, world: World, feeds: list[Feed], tell: Callable[[str], None]
) -> None:
    """Serve the page of `world`, which `feeds` fill, until SIGINT or SIGTERM.

    `tell` is called with the address where the page can be opened. Raises UserError.
    """
    options.check()
    listening = _listen(options)
    server = uvicorn.Server(_config(options, world))
    tell(_address(options, listening.getsockname()[1]))
    feeding = asyncio.ensure_future(_feed(world, feeds))

    def end(_: object) -> None:
        server.should_exit = True

    feeding.add_done_callback(end)
    try:
        await server.serve([listening])
    finally:
        feeding.cancel()
        await asyncio.wait([feeding])
        if not feeding.cancelled():
            with ungrouped():
                feeding.result()


async def _feed(world: World, feeds: list[Feed]) -> None:
    async with asyncio.TaskGroup() as group:
        group.create_task(each_second(world))
        for feed in feeds:
            group.create_task(feed())


def _config(options: Options, world: World) -> uvicorn.Config:
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    ui.run_with(
        app, root=lambda: build_page(Viewer(world, options.may_control, options.plan)),
        title="sdrlinkd", dark=None, tailwind=False, show_welcome_message=False,
        message_history_length=0, reconnect_timeout=10.0, binding_refresh_interval=None,
    )  # fmt: skip
    guarded = Guard(
        app, options.token, is_local=options.is_local, is_https=options.certificate is not None
    )
    return uvicorn.Config(
        guarded, log_level="warning", access_log=False, timeout_graceful_shutdown=1,
        ssl_certfile=options.certificate, ssl_keyfile=options.key,
    )  # fmt: skip


def _listen(options: Options) -> socket.socket:
    family = socket.AF_INET6 if ":" in options.host else socket.AF_INET
    try:
        return socket.create_server((options.host, options.port), family=family)
    except OSError as error:
        told = f"{options.host}:{options.port}"
        raise UserError(f"--listen {told}: {error.strerror or error}") from None


def _address(options: Options, port: int) -> str:
    host = f"[{options.host}]" if ":" in options.host else options.host
    scheme = "http" if options.certificate is None else "https"
    token = f"?{urlencode({'token': options.token})}" if options.token else ""
    return f"{scheme}://{host}:{port}/{token}"
