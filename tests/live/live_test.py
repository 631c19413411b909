"""The live view from outside: its picture and controls in a real browser, and hostile requests."""

import http.client
import json
import os
import pathlib
import re
import socket
import statistics
import struct
import subprocess
import tempfile
import threading
import time
import unittest

from browser import PROGRAM, Browser, Live, read_png

SCENE = """version = 1
[seafloor]
extent_east_m = 60
extent_north_m = 60
cell_m = 0.25
material = "medium sand"
[seafloor.fractal]
height_at_1m_m = 0.05
[[objects]]
shape = "sphere"
diameter_m = 2
east_m = 12
class = "ball"
[track]
pings = 150
altitude_m = 6
speed_mps = 2
ping_interval_s = 0.1
[sonar.sidescan]
down_m = 0
range_m = 24
bins = 200
elevations = 512
[display]
palette = "PALETTE"
slant_range_correction = false
"""


class Scene:
    def __init__(self, palette="grey", **changes):
        self.folder = tempfile.TemporaryDirectory()
        self.file = pathlib.Path(self.folder.name) / "tiny.toml"
        text = SCENE.replace("PALETTE", palette)
        for key, value in changes.items():
            text = re.sub(rf"(?m)^{key} = .*$", f"{key} = {value}", text)
        self.file.write_text(text)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.folder.cleanup()

    def picture(self):
        out = pathlib.Path(self.folder.name) / "run"
        subprocess.run([PROGRAM, "run", self.file, "-o", out, "--quiet"], check=True,
                       env={**os.environ, "ENSONIFY_CACHE": self.folder.name})
        return read_png((out / "sidescan.png").read_bytes())


def pixels(left, width, height):
    """A JavaScript expression for the newest pixels of the picture, four values each. It reads a copy: Chromium draws
    a canvas that is read often in another way, and logs a warning."""
    return ("(() => { const c = document.getElementById('picture');"
            "const copy = Object.assign(document.createElement('canvas'), {width: c.width, height: c.height})"
            ".getContext('2d', {willReadFrequently: true}); copy.drawImage(c, 0, 0);"
            f"return copy.getImageData({left}, 0, {width}, {height}).data }})()")


@unittest.skipIf(Browser.missing(), f"not installed: {', '.join(Browser.missing())}")
class InABrowser(unittest.TestCase):
    def test_the_picture_grows_and_equals_the_run_s_picture_pixel_by_pixel(self):
        for palette, changes in (("grey", {}), ("copper", {"slant_range_correction": "true", "down_m": 2})):
            with Scene(palette, **changes) as scene:
                width, height, channels, expected = scene.picture()
                with Live(scene.file, "--pings-per-s", "25", "--hold") as live, Browser(1300, 900) as browser:
                    browser.open(live.address)
                    browser.wait("window.live?.status?.hold && live.setting")
                    self.assertEqual(browser.run("return document.querySelector('[data-sonar=range_m]').value"), "24")
                    browser.click("hold")
                    some = browser.wait("window.live?.lines > 5 && live.lines")
                    browser.wait(f"live.lines > {some} + 10")
                    browser.wait("live.lines === 150")
                    self.assertEqual(browser.run("return live.missed"), 0)
                    browser.click("one")
                    browser.wait("document.getElementById('state').textContent.includes('done')")
                    wanted = [expected[k % channels::channels] for k in range(3)]
                    drawn_by = time.monotonic() + 20  # what has arrived is drawn when the browser has time
                    while True:
                        shown = bytes(browser.run(f"return [...{pixels(f'(c.width - {width}) >> 1', width, height)}]"))
                        colours = [shown[k::4] for k in range(3)]
                        if colours == wanted or time.monotonic() > drawn_by:
                            break
                        time.sleep(0.5)
                    self.assertEqual(colours, wanted)
                    self.assertEqual(browser.complaints(), [])

    def test_the_controls_do_what_they_say(self):
        with Scene(pings=100000, speed_mps=0.002) as scene, Live(scene.file, "--pings-per-s", "30") as live, \
                Browser(1300, 900) as browser:
            browser.open(live.address)
            browser.wait("window.live?.lines > 30")
            # The mean of the newest lines, and 0 until all of them are drawn: a busy browser draws a line long after
            # it comes.
            mean = (f"(() => {{ const d = {pixels(0, 'c.width', 20)};"
                    "const sum = from => { let s = 0; for (let i = from; i < d.length; i += 4) s += d[i]; return s };"
                    "return sum(0.95 * d.length) > 0 ? 4 * sum(0) / d.length : 0 })()")
            before = browser.wait(mean)
            browser.choose("gain", 12, "input")
            browser.wait(f"{mean} > 1.4 * {before}")
            browser.choose("contrast", 1.8, "input")
            browser.choose("range", "40")
            browser.choose("palette", "viridis")
            # The water column in the middle: violet.
            browser.wait(f"(() => {{ const d = {pixels('c.width / 2', 1, 1)}; return d[2] > 60 && d[1] < 20 }})()")
            browser.click("ground")
            browser.click("labels")
            browser.click("plain")
            browser.wait(f"Math.abs({mean} - {before}) < 8")
            # The waterfall's mouse and buttons.
            browser.click("pause")
            scroll = browser.run("return live.picture.scroll")
            browser.wait(f"live.picture.scroll > {scroll} + 5")
            browser.click("pause")
            browser.wait("live.picture.scroll === 0")
            left, top, wide, high = browser.run(
                "const b = document.getElementById('marks').getBoundingClientRect(); return [b.left, b.top, b.width, b.height]")
            browser.mouse("mouseWheel", left + 300, top + 200, deltaX=0, deltaY=20)
            browser.wait("live.picture.scroll >= 20")
            browser.click("newest")
            browser.mouse("mouseWheel", left + 300, top + 200, deltaX=0, deltaY=-120, modifiers=2)
            browser.wait("live.picture.zoom > 0")
            browser.click("fit")
            # The truth under the cursor on the port side, then the measurement.
            browser.mouse("mouseMoved", left + 0.15 * wide, top + 30)
            readout = "document.getElementById('readout').textContent"
            browser.wait(f"/region ?seabed/.test({readout}) && {readout}")
            text = browser.run("return " + readout)
            for part in ("port", "slant", "sediment", "medium sand", "grazing", "°"):
                self.assertIn(part, text)
            browser.click("measure")
            browser.drag((left + 0.1 * wide, top + 25), (left + 0.2 * wide, top + 35))
            browser.click("pause")
            browser.click("measure")
            browser.click("pause")
            # Changes that all pages see.
            browser.choose("[data-key='track.altitude_m']", 8)
            browser.wait("live.newest.altitude > 7.5")
            browser.choose("[data-sonar='range_m']", 36)
            browser.wait("live.newest.setting.sonars[0].range_m === 36")
            browser.choose("[data-key='track.speed_mps']", 0.003)
            browser.wait("live.status.vehicle.speed_mps === 0.003")
            browser.choose("[data-key='seafloor.material']", "sandy gravel")
            browser.wait("live.newest.setting.materials.includes('sandy gravel')")
            browser.click("drop")
            browser.wait("live.newest.setting.classes.includes('object') && live.status.things === 1")
            browser.click("clear")
            browser.wait("live.status.things === 0")
            browser.choose("pace", "5")
            browser.wait("live.status.wanted_pings_per_s === 5")
            browser.click("hold")
            browser.wait("live.status.hold")
            browser.click("hold")
            browser.wait("!live.status.hold && live.status.pings_per_s > 0")
            browser.wait("live.scene.faces > 100 && live.status.mesh.exact_faces > 10")
            self.assertEqual(browser.run("return live.scene.gl && live.scene.gl.getError()"), 0)
            self.assertEqual(browser.run("return document.getElementById('trouble').textContent"), "")
            self.assertEqual(browser.complaints(), [])
            # A wrong value is reported, and nothing is changed.
            browser.choose("[data-sonar='range_m']", 0.001)
            browser.wait("document.getElementById('trouble').textContent.includes('range_m')")


def request(port, method="GET", path="/", host=None, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
    connection.putheader("Host", f"127.0.0.1:{port}" if host is None else host)
    for name, value in headers.items():
        if name != "body":
            connection.putheader(name.replace("_", "-"), value)
    body = headers.get("body", "").encode()
    if body or method == "POST":
        connection.putheader("Content-Length", str(len(body)))
    connection.endheaders(body or None)
    return connection.getresponse()


def raw(port, data, wait=8.0):
    """Sends bytes; returns the status of the answer, or 0 if the connection is closed without one."""
    with socket.create_connection(("127.0.0.1", port), timeout=wait) as to:
        try:
            to.sendall(data)
        except OSError:
            pass
        try:
            answer = to.recv(200)
        except ConnectionError:
            answer = b""
    return int(answer.split(b" ", 2)[1]) if answer.startswith(b"HTTP/1.1 ") else 0


class Frames:
    """A page that reads frames in a thread and keeps the lines' ping numbers."""

    def __init__(self, port, token):
        self.answer = request(port, path="/lines", X_Ensonify_Token=token)
        self.pings, self.gaps, self.status = [], 0, {}
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()

    def read(self):
        try:
            while len(head := self.answer.read(8)) == 8:
                kind, size = struct.unpack("<II", head)
                body = self.answer.read(size)
                if kind == 2:
                    self.pings.append(struct.unpack_from("<QI", body)[1])
                elif kind == 3:
                    self.status = json.loads(body)
                elif kind == 5:
                    self.gaps += 1
        except (OSError, http.client.HTTPException):
            pass


class OverHttp(unittest.TestCase):
    def setUp(self):
        self.scene = Scene(pings=100000, speed_mps=0.002)
        self.live = Live(self.scene.file, "--pings-per-s", "50")
        page = request(self.live.port).read().decode()
        self.token = re.search(r'name="token" content="([0-9a-f]{64})"', page)[1]

    def tearDown(self):
        code, seconds = self.live.stop()
        self.scene.folder.cleanup()
        self.assertEqual(code, 130)
        self.assertLess(seconds, 5)

    def test_forty_hostile_requests_are_refused(self):
        port, token, ours = self.live.port, self.token, f"127.0.0.1:{self.live.port}"
        own = {"X_Ensonify_Token": token}
        change = {"Content_Type": "application/json", "Origin": f"http://{ours}", **own, "body": '{"hold": true}'}

        def without(name, **instead):
            return {**{k: v for k, v in change.items() if k != name}, **instead}

        asked = [
            # another Host: a foreign name that resolves to this machine
            *[("GET", path, dict(host=host, **own)) for path in ("/", "/lines") for host in
              ("evil.example", f"evil.example:{port}", "127.0.0.1", f"127.0.0.1:{port + 1}", f"127.0.0.1.evil.example:{port}", "")],
            ("POST", "/change", dict(change, host=f"evil.example:{port}", Origin=f"http://evil.example:{port}")),
            # another site
            ("POST", "/change", dict(change, Origin="http://evil.example")),
            ("POST", "/change", dict(change, Origin="null")),
            ("POST", "/change", dict(change, Origin=f"https://{ours}")),
            ("POST", "/change", without("Origin")),
            ("POST", "/change", dict(change, Sec_Fetch_Site="cross-site")),
            ("POST", "/change", dict(change, Content_Type="text/plain")),
            ("GET", "/", dict(Sec_Fetch_Site="cross-site")),
            ("GET", "/lines", dict(own, Origin="http://evil.example")),
            ("GET", "/truth?line=1&column=1", dict(own, Sec_Fetch_Site="same-site")),
            # no token, or a wrong one
            ("POST", "/change", without("X_Ensonify_Token")),
            ("POST", "/change", dict(change, X_Ensonify_Token="0" * 64)),
            ("GET", "/lines", {}),
            ("GET", f"/lines?token={token}", {}),
            ("GET", "/truth?line=1&column=1", {}),
            # other paths
            *[("GET", path, own) for path in ("/../../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd",
                                              "/page.js/../../etc/passwd", "/..%5c..%5cetc%5cpasswd", "/page.html", "/.git/config", "/change")],
            # other methods
            *[(method, "/", own) for method in ("PUT", "DELETE", "OPTIONS", "PATCH", "POST", "HEAD")],
            ("PUT", "/change", change), ("DELETE", "/change", change),
            # ranges, which would make an answer of 80 MB
            ("GET", "/page.js", dict(Range="bytes=" + "0-," * 2600 + "0-")),
            # nonsense
            ("GET", "/truth?line=-1&column=1", own), ("GET", "/truth?line=1e9&column=", own),
            ("GET", "/truth?line=99999999999999999999&column=1", own),
            ("POST", "/change", dict(change, body="{" * 5000)), ("POST", "/change", dict(change, body='{"set": {"seed": -1}}')),
            ("POST", "/change", dict(change, body='{"run": "rm"}')), ("POST", "/change", dict(change, body="x" * 100000)),
            ("POST", "/change", dict(change, body='{"set": {"seafloor.survey": "/etc/passwd"}}')),
            ("POST", "/change", dict(change, body='{"set": {"x=1\\nseed": 3}}')),
        ]
        self.assertGreaterEqual(len(asked), 40)
        for method, path, headers in asked:
            with self.subTest(method=method, path=path, **headers):
                answer = request(port, method, path, **headers)
                self.assertIn(answer.status, range(400, 432))
                body = answer.read()
                self.assertNotIn(b"root:", body)
                self.assertLess(len(body), 20000)
        for data in (b"GET / HTTP/1.1\r\n" + b"A: " + b"a" * 100000 + b"\r\n\r\n",
                     b"GET / HTTP/1.1\r\n" + b"".join(b"H%d: a\r\n" % i for i in range(50000)) + b"\r\n",
                     b"GET /" + b"a" * 100000 + b" HTTP/1.1\r\n\r\n",
                     b"GET / HTTP/1.1\r\nHost: %s\r\nHost: evil.example\r\n\r\n" % ours.encode(),
                     b"GET / HTTP/1.1\r\n\r\n", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", b"\x16\x03\x01\x02\x00", b"\0" * 5000,
                     b"GET / HTTP/1.1\r\nHost: %s\r\nX: " % ours.encode(),  # and never an end
                     b"TRACE / HTTP/1.1\r\nHost: %s\r\n\r\n" % ours.encode(),
                     b"CONNECT evil.example:443 HTTP/1.1\r\nHost: %s\r\n\r\n" % ours.encode()):
            with self.subTest(data=data[:60]):
                self.assertIn(raw(port, data), (0, *range(400, 432)))
        begin = time.monotonic()
        self.assertEqual(raw(port, f"POST /change HTTP/1.1\r\nHost: {ours}\r\nOrigin: http://{ours}\r\n"
                                   f"X-Ensonify-Token: {token}\r\nContent-Type: application/json\r\n"
                                   "Content-Length: -1\r\n\r\n".encode()), 400)
        self.assertLess(time.monotonic() - begin, 3.0)  # a body is waited for 5 s
        # None of these had an effect, and the page's own requests still work.
        frames = Frames(port, token)
        time.sleep(1.0)
        self.assertFalse(frames.status["hold"])
        self.assertGreater(len(frames.pings), 20)
        self.assertEqual(request(port, "POST", "/change", **change).status, 200)

    def test_every_answer_has_the_security_headers(self):
        for path in ("/", "/page.js", "/map.js", "/page.css", "/nothing"):
            headers = request(self.live.port, path=path).headers
            self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
            self.assertEqual(headers["Cache-Control"], "no-store")
            self.assertIn("default-src 'none'", headers["Content-Security-Policy"])
            self.assertIn("script-src 'self'", headers["Content-Security-Policy"])

    def test_ten_pages_and_slow_ones_do_not_slow_the_pings(self):
        def pings_per_s(page, seconds):
            time.sleep(0.6)
            begin, first = time.monotonic(), len(page.pings)
            time.sleep(seconds)
            return (len(page.pings) - first) / (time.monotonic() - begin)

        page = Frames(self.live.port, self.token)
        alone = [pings_per_s(page, 3.0)]
        others = [Frames(self.live.port, self.token) for _ in range(9)]
        stalled = []
        for _ in range(5):
            one = socket.socket()
            one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            one.connect(("127.0.0.1", self.live.port))
            one.sendall(f"GET /lines HTTP/1.1\r\nHost: 127.0.0.1:{self.live.port}\r\nX-Ensonify-Token: {self.token}\r\n\r\n".encode())
            stalled.append(one)
        halt = threading.Event()

        def trickle():
            while not halt.wait(1.0):
                for one in stalled[:3]:
                    try:
                        one.recv(1)
                    except OSError:
                        pass

        threading.Thread(target=trickle, daemon=True).start()
        together = [pings_per_s(page, 4.0)]
        self.assertEqual(page.gaps, 0)
        for other in others:
            self.assertGreater(len(other.pings), 50)
        pings = page.pings
        self.assertEqual(pings, list(range(pings[0], pings[0] + len(pings))))
        # Other programs may have slowed the machine down meanwhile: then again, a few times.
        while max(together) <= 0.9 * min(alone) and len(together) < 5:
            together.append(pings_per_s(page, 3.0))
        self.assertGreater(max(together), 0.9 * min(alone))
        halt.set()
        for one in stalled:
            one.close()

    def test_a_page_that_falls_behind_continues_with_the_newest_line_after_a_gap(self):
        # On a machine that is too busy for 40 pings per second no page falls behind: then again.
        for _ in range(5):
            reader, watcher = self.slow_reader_and_watcher()
            if reader.gaps:
                break
        self.assertEqual(reader.gaps, 1)
        missed = [b - a - 1 for a, b in zip(reader.pings, reader.pings[1:]) if b != a + 1]
        self.assertEqual(len(missed), 1)
        self.assertGreater(missed[0], 40)
        self.assertGreater(reader.pings[-1], watcher.pings[-1] - 40)
        self.assertEqual(watcher.gaps, 0)
        self.assertEqual(watcher.pings, list(range(len(watcher.pings))))

    def slow_reader_and_watcher(self):
        """A page that begins to read after 8 s, and one that reads at once."""
        with Scene(pings=100000, speed_mps=0.002, bins=2000) as scene, \
                Live(scene.file, "--pings-per-s", "40", "--hold") as live:
            token = re.search(r'content="([0-9a-f]{64})"', request(live.port).read().decode())[1]
            slow = socket.socket()
            slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
            slow.connect(("127.0.0.1", live.port))
            slow.sendall(f"GET /lines HTTP/1.1\r\nHost: 127.0.0.1:{live.port}\r\nX-Ensonify-Token: {token}\r\n\r\n".encode())
            watcher = Frames(live.port, token)
            go = dict(Content_Type="application/json", Origin=f"http://127.0.0.1:{live.port}",
                      X_Ensonify_Token=token, body='{"hold": false}')
            self.assertEqual(request(live.port, "POST", "/change", **go).status, 200)
            time.sleep(8.0)  # longer than max_behind (3 s), shorter than longest_standstill (10 s)
            reader = Frames.__new__(Frames)
            reader.answer = http.client.HTTPResponse(slow)
            reader.answer.begin()
            reader.pings, reader.gaps, reader.status = [], 0, {}
            threading.Thread(target=reader.read, daemon=True).start()
            time.sleep(3.0)
            slow.close()
        return reader, watcher


class OnTheCommandLine(unittest.TestCase):
    def test_an_address_that_other_machines_can_reach_is_refused_without_remote(self):
        with Scene() as scene:
            for address in ("0.0.0.0", "192.168.1.5", "::", "127.0.0.1.evil.example"):
                done = subprocess.run([PROGRAM, "live", scene.file, "--port", "0", "--bind", address],
                                      capture_output=True, text=True, timeout=60)
                self.assertEqual(done.returncode, 2)
                self.assertIn("--remote", done.stderr)
            with Live(scene.file, "--bind", "0.0.0.0", "--remote") as live:
                self.assertEqual(request(live.port).status, 200)
                self.assertEqual(request(live.port, host=f"evil.example:{live.port}").status, 400)

    def test_nothing_is_written(self):
        with Scene() as scene:
            folder = pathlib.Path(scene.folder.name)
            with Live(scene.file, "--pings-per-s", "0") as live:
                page = request(live.port).read().decode()
                frames = Frames(live.port, re.search(r'content="([0-9a-f]{64})"', page)[1])
                time.sleep(2.0)
                self.assertGreater(len(frames.pings), 10)
                opened = [os.readlink(f) for f in pathlib.Path(f"/proc/{live.process.pid}/fd").iterdir()]
                self.assertFalse([f for f in opened if f.startswith("/") and not f.startswith(("/dev/", "/proc/", "/sys/"))])
            self.assertEqual([f.name for f in folder.iterdir()], ["tiny.toml"])

    def test_a_taken_port_is_reported(self):
        with Scene() as scene, Live(scene.file) as live:
            done = subprocess.run([PROGRAM, "live", scene.file, "--port", str(live.port)], capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 1)
            self.assertIn("--port", done.stderr)


if __name__ == "__main__":
    unittest.main()
