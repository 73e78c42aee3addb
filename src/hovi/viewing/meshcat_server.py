"""A meshcat page served to browsers on this machine only, by a thread of this process.

Requests that name another host are refused, since a site whose name leads to this machine (DNS
rebinding) could read the page. A browser gets the next message when it has taken the last one, and
those that later ones override are skipped, so what waits for a slow browser does not grow.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading

import tornado.httpserver
import tornado.iostream
import tornado.routing
import tornado.web
import tornado.websocket

from hovi.errors import DisplayError
from hovi.viewing.meshcat_page import VIEWER_FOLDER, Command, Message, Messages, Page

_HOST = "127.0.0.1"
_HOST_NAMES = r"(127\.0\.0\.1|localhost)"
"""Accepted in requests, with any port, since a tunnel may end at another one."""
MAX_BROWSERS = 16
"""Windows that show a page at once; each may hold the copy of one message."""
_MAX_CONNECTIONS = 64
_MAX_HEADER, _MAX_BODY = 16_384, 0  # [bytes]; browsers send requests without a body
_IDLE_SECONDS = 30.0
_TRY_AGAIN_LATER = 1013  # of the WebSocket protocol
_LEAVE_SECONDS = 5.0
_TAKE_SECONDS = 60.0  # for one message, until a browser counts as gone
_LARGE, _LARGE_AT_ONCE = 1_000_000, 2
"""Size above which a message is large, in [bytes], and how many large ones are sent at once: each
connection copies its message."""


class ServedPage(Page):
    """A page whose changes are sent to connected browsers at once.

    title, note: as in Page.
    port: port on the loopback interface; 0 for any free one.
    Raises DisplayError when the port is not available.
    """

    def __init__(self, title: str, note: str = "", port: int = 0) -> None:
        """Start serving an empty page."""
        super().__init__(title, note)
        listener = open_listener(port)
        self.web_url = f"http://{_HOST}:{listener.getsockname()[1]}/view/"
        self._browsers: set[_Browser] = set()
        self._connected = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._loop.call_soon(self._listen, listener)
        self._thread = threading.Thread(target=self._run, name="hovi-viewer", daemon=True)
        self._thread.start()

    def send(self, command: Command) -> None:
        """Store a message and send it to every browser."""
        message = self.keep(command.lower())
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._broadcast, message)

    @property
    def is_open(self) -> bool:
        """Whether the page is still served."""
        return not self._loop.is_closed()

    def wait(self, seconds: float) -> bool:
        """Wait until a browser shows the page; False when none connects within that time [s]."""
        return self._connected.wait(seconds)

    def close(self) -> None:
        """Stop serving. Open pages stay as they are."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_forever()
        finally:
            self._server.stop()
            self._loop.run_until_complete(self._server.close_all_connections())
            for browser in list(self._browsers):  # those that joined meanwhile, too
                browser.leave()
            if rest := asyncio.all_tasks(self._loop):  # of the browsers
                self._loop.run_until_complete(asyncio.wait(rest, timeout=_LEAVE_SECONDS))
            self._loop.run_until_complete(self._loop.shutdown_asyncgens())
            self._loop.close()

    def _listen(self, listener: socket.socket) -> None:
        self._large = asyncio.Semaphore(_LARGE_AT_ONCE)
        self._server = limited_server(
            [
                tornado.web.url(r"/view/", _LivePage, {"page": self}),
                tornado.web.url(r"/view/(main.min.js)", _Script, {"path": str(VIEWER_FOLDER)}),
                tornado.web.url(r"/", _Browser, {"page": self}),
            ],
        )
        self._server.add_socket(listener)

    def _broadcast(self, message: Message) -> None:
        for browser in list(self._browsers):
            browser.show(message)

    def _connect(self, browser: _Browser) -> None:
        if len(self._browsers) >= MAX_BROWSERS:
            browser.leave(_TRY_AGAIN_LATER, "too many windows show this page")
            return
        self._browsers.add(browser)
        for message in self.messages.all():
            browser.show(message)
        self._connected.set()

    def _disconnect(self, browser: _Browser) -> None:
        self._browsers.discard(browser)


def open_listener(port: int) -> socket.socket:
    """A socket that listens on the loopback interface; on any free port for 0.

    Raises DisplayError when the port is not available.
    """
    if not 0 <= port < 2**16:
        raise DisplayError(f"a port is a number from 0 to 65535, not {port}.")
    try:
        listener = socket.create_server((_HOST, port), backlog=128)
    except OSError as error:
        raise DisplayError(
            f"cannot serve a page on port {port} of {_HOST}: {error}; "
            "another program may use it: choose another port, or 0 for any free one."
        ) from error
    listener.setblocking(False)
    return listener


def limited_server(handlers: list[tornado.routing.URLSpec]) -> LimitedServer:
    """A server of pages that answers requests for this machine only, with limited resources."""
    application = tornado.web.Application(
        [(r".*", OtherHost)],
        log_function=lambda handler: None,
        websocket_max_message_size=_MAX_HEADER,
    )
    application.add_handlers(_HOST_NAMES, list(handlers))
    return LimitedServer(
        application,
        idle_connection_timeout=_IDLE_SECONDS,
        body_timeout=_IDLE_SECONDS,
        max_header_size=_MAX_HEADER,
        max_body_size=_MAX_BODY,
    )


class LimitedServer(tornado.httpserver.HTTPServer):
    """A server with a limited number of open connections, without those that became WebSockets."""

    _open = 0

    def handle_stream(self, stream: tornado.iostream.IOStream, address: tuple[object, ...]) -> None:
        """Take a connection, or close it if there are too many."""
        if self._open >= _MAX_CONNECTIONS:
            stream.close()
            return
        self._open += 1
        super().handle_stream(stream, address)

    def on_close(self, server_conn: object) -> None:
        """Count a connection that ended."""
        self._open -= 1
        super().on_close(server_conn)


class OtherHost(tornado.web.RequestHandler):
    """The answer to a request for another host."""

    def prepare(self) -> None:
        """Refuse it."""
        self.set_status(403)
        self.finish(f"This page is served to {_HOST} and localhost only.\n")


class _LivePage(tornado.web.RequestHandler):
    """The page itself."""

    def initialize(self, page: ServedPage) -> None:
        self.page = page

    def get(self) -> None:
        self.write(self.page.live_html(self.request.host))


class _Script(tornado.web.StaticFileHandler):
    """meshcat's script, sent so that browsers do not cache it."""

    def set_extra_headers(self, path: str) -> None:
        self.set_header("Cache-Control", "no-store")


class _Browser(tornado.websocket.WebSocketHandler):
    """The connection to one open page, and not to pages of other sites."""

    def initialize(self, page: ServedPage) -> None:
        self.page = page
        self.waiting = Messages(deletions=True)
        self.sender: asyncio.Task[None] | None = None

    def prepare(self) -> None:
        """Refuse pages of other sites, as Tornado does except for an origin that is no address."""
        origin = self.request.headers.get("Origin")
        if origin is not None and origin.partition("://")[2].lower() != self.request.host.lower():
            self.set_status(403)
            self.finish("This page is served to itself only.\n")

    def open(self, *args: str, **kwargs: str) -> None:
        self.page._connect(self)

    def on_message(self, message: str | bytes) -> None:
        """Messages from a page are ignored."""

    def on_close(self) -> None:
        self.page._disconnect(self)

    def show(self, message: Message) -> None:
        """Send a message after those that wait, without blocking."""
        self.waiting.add(message)
        if self.sender is None or self.sender.done():
            self.sender = asyncio.ensure_future(self._send())

    async def _send(self) -> None:
        """Send what waits, each message after the browser has taken the one before."""
        try:
            while (packed := self.waiting.take()) is not None:
                async with self.page._large if len(packed) > _LARGE else contextlib.nullcontext():
                    written = self.write_message(packed, binary=True)
                    written.add_done_callback(lambda done: done.exception())
                    if not (await asyncio.wait({written}, timeout=_TAKE_SECONDS))[0]:
                        self.leave()
        except tornado.websocket.WebSocketClosedError:  # a browser may close any time
            self.page._disconnect(self)

    def leave(self, code: int | None = None, reason: str | None = None) -> None:
        """End the connection at once, without waiting for the browser's answer.

        code, reason: of the WebSocket protocol.
        """
        self.page._disconnect(self)
        stream = None if self.ws_connection is None else self.ws_connection.stream
        if stream is not None:
            self.close(code, reason)
            stream.close()
