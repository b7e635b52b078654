"""Chromium without a window, as much of it as a test needs: open a page, run a script in it, take its picture."""

from __future__ import annotations

import base64
import contextlib
import io
import itertools
import json
import shutil
import subprocess
import time

import numpy as np
from PIL import Image

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
SOFTWARE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # WebGL without a GPU


class Browser:
    """One tab."""

    def __init__(self, socket):
        self.socket, self.numbers = socket, itertools.count(1)

    def call(self, method, **params):
        """A command of the DevTools protocol, and its result."""
        number = next(self.numbers)
        self.socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            said = json.loads(self.socket.recv(timeout=60))
            if said.get("id") == number:
                assert "error" not in said, said["error"]
                return said["result"]

    def run(self, script):
        """The value of an expression."""
        return self.call("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def picture(self):
        """The page as it looks, [H, W, 3]."""
        data = self.call("Page.captureScreenshot", format="png")["data"]
        return np.array(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"))

    def until(self, condition, seconds):
        """Wait until a function is true; its last value."""
        end = time.monotonic() + seconds
        while not (found := condition()) and time.monotonic() < end:
            time.sleep(0.3)
        return found


@contextlib.contextmanager
def browsing(folder, url, width=1280, height=800, mobile=False):
    """A browser with its profile in `folder` that has a page open."""
    from websockets.sync.client import connect

    flags = ("--headless", "--no-sandbox", "--remote-debugging-port=0", "--no-first-run", "--disable-extensions")
    process = subprocess.Popen(
        [CHROMIUM, *flags, *SOFTWARE, f"--user-data-dir={folder}", f"--window-size={width},{height}", "about:blank"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        line = next(line for line in process.stderr if line.startswith("DevTools listening on "))
        address = line.split()[-1]
        with connect(address, max_size=None) as socket:
            browser = Browser(socket)
            target = browser.call("Target.createTarget", url="about:blank")["targetId"]
        with connect(f"{address.partition('/devtools')[0]}/devtools/page/{target}", max_size=None) as socket:
            browser = Browser(socket)
            size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": mobile}
            browser.call("Emulation.setDeviceMetricsOverride", **size)
            browser.call("Page.enable")
            browser.call("Page.navigate", url=url)
            yield browser
    finally:
        process.terminate()
        process.wait(20)
