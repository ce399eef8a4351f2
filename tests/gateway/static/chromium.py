"""Debian's Chromium, driven over the DevTools protocol: no driver, no further dependency."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
from websockets.sync.client import ClientConnection, connect

WAIT_S = 90.0  # for a browser on a busy machine; a failure, not a pace
COMMAND = shutil.which("chromium") or shutil.which("google-chrome") or ""
FLAGS = (
    "--headless=new",
    "--no-sandbox",  # containers run as root
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--remote-debugging-port=0",
)
# Resolves once the condition holds; looks again after every 30 ms.
STATE_SHOWN = "document.querySelector('#services li')"
WAIT_FOR = """new Promise((resolve, reject) => {
  const end = performance.now() + %d;
  const look = () => {
    if (%s) resolve(true);
    else if (performance.now() > end) reject(new Error("never true"));
    else setTimeout(look, 30);
  };
  look();
})"""
# The centre of an element, if it is there to be clicked: inside the window and not covered.
CENTRE = """(() => {
  const node = document.querySelector(%s);
  const box = node.getBoundingClientRect();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const hit = document.elementFromPoint(x, y);
  return hit && node.contains(hit) ? [x, y] : null;
})()"""


@dataclass
class Page:
    """A tab. ``errors``: what its console has shown as an error, uncaught exceptions included."""

    socket: ClientConnection
    errors: list[str] = field(default_factory=list)
    _last: int = 0

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """The result of a method of the DevTools protocol."""
        self._last += 1
        self.socket.send(json.dumps({"id": self._last, "method": method, "params": params}))
        while True:
            message = json.loads(self.socket.recv(timeout=WAIT_S))
            if message.get("id") == self._last:
                assert "error" not in message, (method, message["error"])
                result: dict[str, Any] = message["result"]
                return result
            self._note(message)

    def evaluate(self, expression: str) -> Any:
        """The value of a JavaScript expression; promises are awaited."""
        result = self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in result, (expression, result["exceptionDetails"])
        return result["result"].get("value")

    def wait_for(self, condition: str) -> None:
        """Return when the JavaScript condition holds."""
        self.evaluate(WAIT_FOR % (WAIT_S / 2 * 1000, condition))

    def text(self, selector: str) -> str:
        """The text that the element shows."""
        return str(self.evaluate(f"document.querySelector({json.dumps(selector)}).innerText"))

    def centre(self, selector: str) -> tuple[float, float] | None:
        """The element's centre in the window; None if it is outside or covered."""
        place = self.evaluate(CENTRE % json.dumps(selector))
        return None if place is None else (place[0], place[1])

    def click(self, selector: str) -> None:
        """Scroll to the element and click it as a mouse does."""
        name = json.dumps(selector)
        self.evaluate(f"document.querySelector({name}).scrollIntoView({{block: 'nearest'}})")
        self.wait_for("(" + CENTRE % name + ")")
        place = self.centre(selector)
        assert place is not None
        self.drag(place, place)

    def drag(
        self, start: tuple[float, float], end: tuple[float, float], button: str = "left"
    ) -> None:
        """Press the mouse at ``start`` and release it at ``end``; a click if they are the same."""
        mouse = {"button": button, "clickCount": 1}
        self._mouse("mousePressed", start, **mouse)
        if start != end:
            self._mouse("mouseMoved", end, **mouse)
        self._mouse("mouseReleased", end, **mouse)

    def point(self, place: tuple[float, float]) -> None:
        """Move the mouse to the place."""
        self._mouse("mouseMoved", place)

    def tap(self, place: tuple[float, float]) -> None:
        """Touch the place with a finger."""
        points = [{"x": place[0], "y": place[1]}]
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=points)
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def press(self, key: str, *, shift: bool = False) -> None:
        """Press a key; "Enter" and " " also activate what has the focus."""
        pressed: dict[str, Any] = {
            "key": key,
            "code": key,
            "text": {"Enter": "\r", " ": " "}.get(key, ""),
            "modifiers": 8 if shift else 0,
            "windowsVirtualKeyCode": 27 if key == "Escape" else 0,  # by which a dialog knows it
        }
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, **pressed)

    def _mouse(self, kind: str, place: tuple[float, float], **mouse: Any) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=place[0], y=place[1], **mouse)

    def type(self, selector: str, text: str) -> None:
        """Replace the text of a field."""
        name = json.dumps(selector)
        self.evaluate(f"document.querySelector({name}).select()")
        self.click(selector)
        self.evaluate(f"document.querySelector({name}).select()")
        self.call("Input.insertText", text=text)

    def resize(self, width_px: int, height_px: int, *, mobile: bool = False) -> None:
        """Set the size of the window; ``mobile``: of a telephone that is touched."""
        self.call("Emulation.setTouchEmulationEnabled", enabled=mobile)
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width_px,
            height=height_px,
            deviceScaleFactor=1,
            mobile=mobile,
        )

    def prefer(self, scheme: str) -> None:
        """Ask for ``light`` or ``dark``."""
        features = [
            {"name": "prefers-color-scheme", "value": scheme},
            {"name": "prefers-reduced-motion", "value": "reduce"},
        ]
        self.call("Emulation.setEmulatedMedia", features=features)

    def open(self, address: str, ready: str = STATE_SHOWN) -> None:
        """Load the address and wait until ``ready``, by default until it shows a state."""
        self.call("Page.navigate", url=address)
        self.wait_for(ready)

    def _note(self, event: dict[str, Any]) -> None:
        params = event.get("params", {})
        if event["method"] == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.errors.append(params["entry"]["text"])
        elif event["method"] == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(params["exceptionDetails"]))
        elif event["method"] == "Runtime.consoleAPICalled" and params["type"] == "error":
            self.errors.append(json.dumps(params["args"]))


@dataclass(frozen=True)
class Chromium:
    """A running browser without a window."""

    address: str

    @contextmanager
    def page(self) -> Iterator[Page]:
        """A new tab, closed at the end."""
        tab = httpx.put(f"http://{self.address}/json/new?about:blank", timeout=WAIT_S).json()
        with connect(tab["webSocketDebuggerUrl"], max_size=None) as socket:
            page = Page(socket)
            for domain in ("Page", "Runtime", "Log"):
                page.call(f"{domain}.enable")
            yield page
            page.call("Page.close")


@contextmanager
def running_chromium(folder: Path) -> Iterator[Chromium]:
    """Chromium with its profile in ``folder``."""
    process = subprocess.Popen(
        [COMMAND, *FLAGS, f"--user-data-dir={folder}", "about:blank"],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "HOME": str(folder)},
    )
    assert process.stderr is not None
    try:
        for line in process.stderr:
            _, found, rest = line.partition("DevTools listening on ws://")
            if found:
                # read on: a full pipe would stop the browser
                threading.Thread(target=process.stderr.read, daemon=True).start()
                yield Chromium(rest.split("/")[0])
                return
        raise AssertionError(f"{COMMAND} ended with {process.wait()} before it listened")
    finally:
        process.terminate()
        process.wait(timeout=WAIT_S)
