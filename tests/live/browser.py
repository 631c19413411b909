"""A headless Chromium driven over WebDriver, and the program `ensonify live`. Uses only the standard library."""

import base64
import json
import os
import shutil
import signal
import struct
import subprocess
import time
import urllib.error
import urllib.request
import zlib

PROGRAM = os.environ.get("ENSONIFY_PROGRAM", "build/bin/ensonify")


class Live:
    """`ensonify live` with a scene, at any free port."""

    def __init__(self, scene, *arguments):
        self.process = subprocess.Popen([PROGRAM, "live", scene, "--port", "0", "--quiet", *arguments],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        if not self.address:
            raise RuntimeError(self.process.communicate()[1])
        self.port = int(self.address.rstrip("/").rsplit(":", 1)[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()

    def stop(self):
        """Ends the program as Ctrl-C does. Returns its exit code and the seconds that took."""
        begin = time.monotonic()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            self.errors = self.process.communicate(timeout=60)[1]
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        return self.process.returncode, time.monotonic() - begin


class Browser:
    """One browser window. Check `missing()` first."""

    @staticmethod
    def missing():
        return [name for name in ("chromium", "chromedriver") if not shutil.which(name)]

    def __init__(self, width=1440, height=900):
        self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE,
                                       stderr=subprocess.DEVNULL, text=True)
        for line in self.driver.stdout:
            if "successfully on port" in line:
                self.at = "http://127.0.0.1:" + line.rsplit(" ", 1)[1].strip(" .\n")
                break
        flags = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars",
                 "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--force-color-profile=srgb",
                 f"--window-size={width},{height}"]
        session = self._post("/session", {"capabilities": {"alwaysMatch": {
            "goog:chromeOptions": {"args": flags}, "goog:loggingPrefs": {"browser": "ALL"}}}})
        self.at += "/session/" + session["sessionId"]
        self.size(width, height)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            urllib.request.urlopen(urllib.request.Request(self.at, method="DELETE"), timeout=20).close()
        except OSError:
            pass
        self.driver.terminate()
        self.driver.wait()
        self.driver.stdout.close()

    def _post(self, path, body):
        request = urllib.request.Request(self.at + path, json.dumps(body).encode(),
                                         {"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=120) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(json.load(error)["value"]["message"].split("\n")[0]) from None

    def devtools(self, command, **parameters):
        return self._post("/goog/cdp/execute", {"cmd": command, "params": parameters})

    def size(self, width, height):
        """Sets the size of the page, without the window's frame."""
        self.devtools("Emulation.setDeviceMetricsOverride", width=width, height=height,
                      deviceScaleFactor=1, mobile=False)

    def theme(self, name):
        self.devtools("Emulation.setEmulatedMedia",
                      features=[{"name": "prefers-color-scheme", "value": name}])

    def open(self, address):
        self._post("/url", {"url": address})

    def run(self, script, *arguments):
        """Runs a function body in the page and returns its value."""
        return self._post("/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, script, seconds=60):
        """Waits until an expression in the page is true and returns its value."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            value = self.run("return " + script)
            if value:
                return value
            time.sleep(0.1)
        raise AssertionError(f"not within {seconds} s: {script}")

    def mouse(self, kind, x, y, **more):
        self.devtools("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def click(self, element):
        x, y = self.run("const e = document.getElementById(arguments[0]); e.scrollIntoView({block: 'nearest'});"
                        "const b = e.getBoundingClientRect();"
                        "return [b.left + b.width / 2, b.top + b.height / 2]", element)
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(kind, x, y, button="left", clickCount=1)

    def drag(self, start, end):
        self.mouse("mouseMoved", *start)
        self.mouse("mousePressed", *start, button="left", clickCount=1)
        self.mouse("mouseMoved", *end, button="left", buttons=1)
        self.mouse("mouseReleased", *end, button="left", clickCount=1)

    def choose(self, element, value, event="change"):
        self.run("const e = document.getElementById(arguments[0]) ?? document.querySelector(arguments[0]);"
                 "e.value = arguments[1]; e.dispatchEvent(new Event(arguments[2], {bubbles: true}))",
                 element, value, event)

    def complaints(self):
        """The warnings and errors of the browser's console."""
        return [entry["message"] for entry in self._post("/se/log", {"type": "browser"})
                if entry["level"] in ("SEVERE", "WARNING") and "GPU stall" not in entry["message"]]

    def screenshot(self):
        with urllib.request.urlopen(self.at + "/screenshot", timeout=60) as answer:
            return base64.b64decode(json.load(answer)["value"])


def read_png(data):
    """Width, height, channels and pixel bytes of a PNG with 8 bits, not interlaced."""
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", chunk[:10])
        if kind == b"IDAT":
            packed += chunk
        at += 12 + size
    assert bits == 8
    channels = {0: 1, 2: 3, 6: 4}[colour]
    stride, raw, rows = width * channels, zlib.decompress(packed), []
    before = bytearray(stride)
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            a = line[i - channels] if i >= channels else 0
            b, c = before[i], before[i - channels] if i >= channels else 0
            if kind == 1:
                line[i] = (line[i] + a) & 255
            elif kind == 2:
                line[i] = (line[i] + b) & 255
            elif kind == 3:
                line[i] = (line[i] + (a + b) // 2) & 255
            elif kind == 4:
                p = a + b - c
                nearest = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
                line[i] = (line[i] + nearest) & 255
        rows.append(bytes(line))
        before = line
    return width, height, channels, b"".join(rows)
