"""A meshcat page stored as messages, and written as one HTML file that works offline.

`meshcat.Visualizer` sends its messages to a window. meshcat's own window starts a server process
that listens on every network interface; `Page` stores the messages instead, so that a page can be
written without a server, or served by `meshcat_server` on the loopback interface only.
"""

from __future__ import annotations

import base64
import gzip
import html
import importlib.util
import json
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from string import Template
from typing import Any, NamedTuple, Protocol

import umsgpack

from hovi.viewing.panel.panel import Panel

_MESHCAT = importlib.util.find_spec("meshcat")
assert _MESHCAT is not None
assert _MESHCAT.origin is not None
VIEWER_FOLDER = Path(_MESHCAT.origin).parent / "viewer" / "dist"

_UUID = re.compile(rb"[0-9a-f]{8}-[0-9a-f]{4}-1[0-9a-f]{3}-[0-9a-f]{4}-[0-9a-f]{12}")

_PARTS = Path(__file__).parent / "panel"

# With this policy the browser itself blocks every network access but to the server of a live page.
_POLICY = """
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; base-uri 'none'; \
form-action 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:{script}; worker-src blob:; \
style-src 'unsafe-inline'; img-src data: blob:; connect-src data: blob:{socket}">"""

_OFFLINE = """<script>
async function unpacked(text) {{
    const bytes = atob(text), packed = new Uint8Array(bytes.length);
    for (let i = 0; i < bytes.length; i++) packed[i] = bytes.charCodeAt(i);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}}
function joined(parts) {{
    const whole = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
    parts.reduce((at, part) => (whole.set(part, at), at + part.length), 0);
    return whole;
}}
(async () => {{
    const [script, small, ...large] = await Promise.all([{packed}].map(unpacked));
    const element = document.createElement("script");
    element.textContent = new TextDecoder().decode(script);
    document.body.append(element);
    const ends = {sizes}.map((sum => size => sum += size)(0));
    const parts = ends.map((end, i) => small.subarray(i > 0 ? ends[i - 1] : 0, end)).concat(large);
    for (const numbers of {messages}) {{
        viewer.handle_command_bytearray(joined(numbers.map(i => parts[i])));
    }}
    viewer.animator.mixer.timeScale = {speed};
}})();
</script>"""
"""Unpacks meshcat and the page's own script, then the messages, each of which consists of parts.

Large parts are packed each for itself, so that pages of one robot have the same texts for its
meshes, and small ones together. All messages are handled at once: between two of them the browser
would draw what is there so far.
"""
_LARGE_ARRAY = 1_000
"""Size from which an array is a part of its own, in [bytes]: equal parts are packed once."""

_UNPACK = """<!DOCTYPE html><meta charset="utf-8"><script>
const bytes = atob("{packed}"), packed = new Uint8Array(bytes.length);
for (let i = 0; i < bytes.length; i++) packed[i] = bytes.charCodeAt(i);
const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
new Response(stream).text().then(text => {{
    document.open(); document.write(text); document.close();
}});
</script>"""


def packed(page: str) -> str:
    """A page that unpacks another one, which is compressed: robots are mostly their meshes."""
    return _UNPACK.format(packed=_compressed(page.encode()))


class Command(Protocol):
    """A command that meshcat sends to a window."""

    def lower(self) -> dict[str, Any]:
        """The message as a dictionary for MessagePack."""


class Message(NamedTuple):
    """A packed message to meshcat's window, replaced by a later one with the same other fields.

    path: of the part of the scene. kind: such as "set_object" or "delete". name: of the property
    that is set, or "".
    """

    path: str
    kind: str
    name: str
    packed: bytes


class Messages:
    """Messages in their order, without those that a later one replaces.

    deletions: whether to keep the deletion of parts, which a new window does not need.
    """

    def __init__(self, deletions: bool = False) -> None:
        self._deletions = deletions
        self._packed: dict[tuple[str, str, str], bytes] = {}

    def add(self, message: Message) -> None:
        """Add a message, and drop those that it replaces."""
        is_deletion = message.kind == "delete"
        if is_deletion:
            inside = message.path.rstrip("/") + "/"
            for key in [k for k in self._packed if f"{k[0]}/".startswith(inside)]:
                del self._packed[key]
        if self._deletions or not is_deletion:
            self._packed[message[:3]] = message.packed

    def take(self) -> bytes | None:
        """Remove the first message and return it; None if there is none."""
        key = next(iter(self._packed), None)
        return None if key is None else self._packed.pop(key)

    def all(self) -> list[Message]:
        """The messages; the copy is atomic, since another thread may add some meanwhile."""
        return [Message(*key, packed) for key, packed in self._packed.copy().items()]


class Page:
    """A window for `meshcat.Visualizer` that stores what is drawn.

    A message that a later one overrides is dropped, so that the page does not grow.

    title: of the browser's window, and a line in the page's corner.
    note: a second line there, such as a sentence about meshes that were not found.
    cautions: lines there, of the motions, that films show too.
    panel: what is shown next to the scene; empty at first.
    """

    def __init__(self, title: str, note: str = "") -> None:
        """An empty page."""
        self.title, self.note = title, note
        self.cautions: list[str] = []
        self.panel = Panel()
        self.web_url = ""
        self.messages = Messages()
        self._uuids: dict[bytes, bytes] = {}

    def send(self, command: Command) -> None:
        """Store a message. The method's name is meshcat's."""
        self.keep(command.lower())

    def keep(self, message: Mapping[str, Any]) -> Message:
        """Store a message and return it packed."""
        packed = _UUID.sub(self._stable_uuid, umsgpack.packb(message))
        path, name = message.get("path", ""), str(message.get("property", ""))
        kept = Message(path, message["type"], name, packed)
        self.messages.add(kept)
        return kept

    def offline_html(self, speed: float = 1.0) -> str:
        """The page as one HTML file that loads nothing else.

        speed: time scale of the animation.
        """
        script = (VIEWER_FOLDER / "main.min.js").read_text(encoding="utf-8")
        messages = [_parts_of(message.packed) for message in self.messages.all()]
        parts = dict.fromkeys(part for message in messages for part in message)
        small = [part for part in parts if len(part) < _LARGE_ARRAY]
        large = [part for part in parts if len(part) >= _LARGE_ARRAY]
        numbers = {part: number for number, part in enumerate([*small, *large])}
        contents = [f"{script}\n{_own_script()}".encode(), b"".join(small), *large]
        start = _OFFLINE.format(
            packed=",".join(f'"{_compressed(each)}"' for each in contents),
            sizes=_json([len(part) for part in small]),
            messages=_json([[numbers[part] for part in message] for message in messages]),
            speed=float(speed),
        )
        return self._fill(_POLICY.format(script="", socket=""), start)

    def live_html(self, host: str) -> str:
        """The page that receives its messages from the server.

        host: name and port of the server, as the browser has them.
        """
        policy = _POLICY.format(script=" 'self'", socket=html.escape(f" ws://{host}"))
        start = (
            '<script src="main.min.js"></script>\n'
            f"<script>\n{_own_script()}\nviewer.connect();\n</script>"
        )
        return self._fill(policy, start)

    def _fill(self, policy: str, start: str) -> str:
        parts = {
            "policy": policy,
            "title": html.escape(self.title),
            "note": html.escape(self.note),
            "cautions": html.escape("\n".join(self.cautions)),
            "style": _part("page.css"),
            "panel": self.panel.to_json(),
            "start": start,
        }
        return Template(_part("page.html")).substitute(parts)

    def _stable_uuid(self, match: re.Match[bytes]) -> bytes:
        """Replace meshcat's identifiers, which contain time and MAC address, by a counter."""
        number = len(self._uuids)
        return self._uuids.setdefault(match[0], b"%08x-0000-4000-8000-000000000000" % number)


def _parts_of(message: bytes) -> list[bytes]:
    """A message divided where large arrays begin and end."""
    found, at = [], 0
    for array in _arrays(umsgpack.unpackb(message)):
        if len(array) >= _LARGE_ARRAY:
            begin = message.index(array, at)
            found += [message[at:begin], array]
            at = begin + len(array)
    return [*found, message[at:]]


def _arrays(value: Any) -> Iterator[bytes]:
    """The arrays in a message, in the order in which they are packed."""
    if isinstance(value, umsgpack.Ext):
        yield value.data
    elif isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _arrays(each)


def _json(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"))


def _compressed(content: bytes) -> str:
    # No time in it: the same page gives the same bytes.
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def _own_script() -> str:
    return _part("stage.js") + _part("controls.js")


@cache
def _part(name: str) -> str:
    """The text of a file of the page."""
    return (_PARTS / name).read_text(encoding="utf-8")
