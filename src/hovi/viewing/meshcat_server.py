"""A meshcat page served to browsers on this machine only, by a thread of this process."""

from __future__ import annotations

import asyncio
import socket
import threading

import tornado.httpserver
import tornado.web
import tornado.websocket

from hovi.errors import DisplayError
from hovi.viewing.meshcat_page import VIEWER_FOLDER, Command, Page

_HOST = "127.0.0.1"


class ServedPage(Page):
    """A page whose changes are sent to connected browsers at once.

    title, note: as in Page.
    port: port on the loopback interface; 0 for any free one.
    Raises DisplayError when the port is not available.
    """

    def __init__(self, title: str, note: str = "", port: int = 0) -> None:
        """Start serving an empty page."""
        super().__init__(title, note)
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
        self.web_url = f"http://{_HOST}:{listener.getsockname()[1]}/view/"
        self._browsers: set[_Browser] = set()
        self._connected = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._loop.call_soon(self._listen, listener)
        self._thread = threading.Thread(target=self._run, name="hovi-viewer", daemon=True)
        self._thread.start()

    def send(self, command: Command) -> None:
        """Store a message and send it to every browser."""
        packed = self.keep(command.lower())
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._broadcast, packed)

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
            for browser in list(self._browsers):
                browser.close()
            self._loop.run_until_complete(self._server.close_all_connections())
            self._loop.run_until_complete(self._loop.shutdown_asyncgens())
            self._loop.close()

    def _listen(self, listener: socket.socket) -> None:
        application = tornado.web.Application(
            [
                tornado.web.url(r"/view/", _LivePage, {"page": self}),
                tornado.web.url(r"/view/(main.min.js)", _Script, {"path": str(VIEWER_FOLDER)}),
                tornado.web.url(r"/", _Browser, {"page": self}),
            ],
            log_function=lambda handler: None,
        )
        self._server = tornado.httpserver.HTTPServer(application)
        self._server.add_socket(listener)

    def _broadcast(self, packed: bytes) -> None:
        for browser in list(self._browsers):
            browser.show(packed)

    def _connect(self, browser: _Browser) -> None:
        for message in self.messages:
            browser.show(message)
        self._browsers.add(browser)
        self._connected.set()

    def _disconnect(self, browser: _Browser) -> None:
        self._browsers.discard(browser)


class _LivePage(tornado.web.RequestHandler):
    """The page itself."""

    def initialize(self, page: ServedPage) -> None:
        self.page = page

    def get(self) -> None:
        self.write(self.page.live_html())


class _Script(tornado.web.StaticFileHandler):
    """meshcat's script, sent so that browsers do not cache it."""

    def set_extra_headers(self, path: str) -> None:
        self.set_header("Cache-Control", "no-store")


class _Browser(tornado.websocket.WebSocketHandler):
    """The connection to one open page. Tornado refuses connections from pages of other sites."""

    def initialize(self, page: ServedPage) -> None:
        self.page = page

    def open(self, *args: str, **kwargs: str) -> None:
        self.page._connect(self)

    def on_message(self, message: str | bytes) -> None:
        """Messages from a page are ignored."""

    def on_close(self) -> None:
        self.page._disconnect(self)

    def show(self, packed: bytes) -> None:
        try:
            future = self.write_message(packed, binary=True)
        except tornado.websocket.WebSocketClosedError:
            return self.page._disconnect(self)
        future.add_done_callback(lambda done: done.exception())  # a browser may close any time
