"""Attacks on commands that answer until they are stopped: `stream` and `live`."""

import contextlib
import http.client
import json
import pathlib
import re
import socket
import struct
import subprocess
import time

from attack import Failed, Row
from jobs import pose


class LongStream(Row):
    title = "long streams: memory, descriptors and threads do not grow"
    unit = "pings"
    warm, pings = 200, 800

    def trial(self, draw):
        job = next(j for j in self.jobs if j.name == "stream")
        process = self.program.start(job.args, job.folder, stdin=subprocess.PIPE)
        own = pathlib.Path(f"/proc/{process.pid}")

        def state():
            status = dict(line.split(":\t") for line in (own / "status").read_text().splitlines()
                          if ":\t" in line)
            return (int(status["RssAnon"].split()[0]), len(list((own / "fd").iterdir())),
                    int(status["Threads"]))

        def answer():
            line = process.stdout.readline()
            if not line:
                raise Failed(f"ended: {process.stderr.read().decode()[-400:]}")
            return json.loads(line)

        before = None
        try:
            lines = sum(len(sonar["sides"]) * sonar["beams"] for sonar in answer()["sonars"])
            for k in range(self.pings):
                process.stdin.write(pose(k, draw))
                process.stdin.flush()
                for _ in range(lines):
                    process.stdout.read(answer()["bytes"])
                if k == self.warm:
                    before = state()
            after = state()
        finally:
            process.kill()
            process.communicate()
        if after[0] > before[0] + 1024 or after[1:] != before[1:]:
            raise Failed(f"anonymous kB, descriptors, threads: {before} at ping {self.warm}, {after} "
                         f"at ping {self.pings}")
        return self.pings


class LivePage(Row):
    title = "any request to the live page: an answer below 500, and pings continue"
    unit = "requests"
    requests = 40

    def trial(self, draw):
        scene = self.jobs[0].folder.parent / "whole/samples/000000/scene.toml"
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        process = self.program.start(["live", scene, "--port", self.port, "--quiet"], self.folder,
                                     stdin=subprocess.DEVNULL)
        try:
            for _ in range(1200):  # until the seafloor is prepared
                with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1):
                    break
                time.sleep(0.1)
            token = re.search(rb'content="([0-9a-f]{64})"', self.ask("GET", "/").read())[1].decode()
            for _ in range(self.requests):
                (self.send_bytes if draw.random() < 0.3 else self.send_request)(draw, token)
                if process.poll() is not None:
                    raise Failed(f"ended with {process.returncode}")
            # Whatever was held or cleared: again from the track's beginning.
            go = json.dumps({"hold": False, "pings_per_s": 20, "again": True})
            if self.ask("POST", "/change", token, go).status != 200:
                raise Failed("a valid change is refused after other requests")
            lines = self.ask("GET", "/lines", token)
            deadline = time.monotonic() + 30
            line = 2  # the kind of a frame
            while (frame := struct.unpack("<II", lines.read(8)))[0] != line:
                lines.read(frame[1])
                if time.monotonic() > deadline:
                    raise Failed("no ping for 30 s after other requests")
        except (OSError, http.client.HTTPException, struct.error, TypeError) as problem:
            process.kill()
            raise Failed(f"{problem}; {process.stderr.read().decode()[-400:]}") from None
        finally:
            process.kill()
            process.communicate()
        return self.requests

    def ask(self, method, path, token="", body=None, host=None):
        page = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        headers = {"Host": host or f"127.0.0.1:{self.port}", "Origin": f"http://127.0.0.1:{self.port}",
                   "X-Ensonify-Token": token, "Content-Type": "application/json"}
        page.request(method, path, body, headers)
        return page.getresponse()

    def send_bytes(self, draw, token):
        head = draw.choice([draw.randbytes(draw.randint(1, 400)),
                            f"POST /change HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\nX-Ensonify-Token: "
                            f"{token}\r\nContent-Length: {draw.choice([5, 1 << 20, -1])}\r\n".encode()])
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1) as raw:
            raw.sendall(head + draw.choice([b"", b"\r\n\r\n", b" HTTP/1.1\r\nHost: x\r\n\r\n"]))

    def send_request(self, draw, token):
        paths = ["/", "/page.js", "/truth?line=3&column=10", f"/truth?line={draw.randrange(1 << 64)}&column=1",
                 "/truth?line=-1&column=x", "/lines", "/lines?mesh=1", "/../etc/passwd", "/%00", "/" + "a" * 9000]
        method, path, body = draw.choice([("GET", draw.choice(paths), None),
                                          (draw.choice(["PUT", "HEAD", "OPTIONS", "POST"]), draw.choice(paths), None),
                                          ("POST", "/change", self.change(draw)),
                                          ("POST", "/change", self.change(draw))])
        with contextlib.suppress(TimeoutError):
            answer = self.ask(method, path, draw.choice([token, token, token, "", "0" * 64]), body,
                              draw.choice([None, None, None, "example.org"]))
            if answer.status >= 500 and not (path.startswith("/lines") and answer.status == 503):
                raise Failed(f"{method} {path} {body}: an answer of {answer.status}")

    @staticmethod
    def change(draw):
        number = draw.choice([0, -1, 1, 0.5, 7, 1e9, 1e308, "x", None, [], {}, True])
        key = draw.choice(["track.altitude_m", "track.speed_mps", "sonar.left-right.range_m",
                           "sonar.left-right.bins", "sonar.left-right.tilt_deg", "display.gamma", "seed",
                           "seafloor.depth_m", "x\n=1"])
        whole = draw.choice([{"set": {key: number}}, {"set": number}, {"hold": number},
                             {"pings_per_s": number}, {"clear": number}, {"again": True},
                             {"add": {"shape": draw.choice(["box", "wreck", "x"]), "ahead_m": number}},
                             {"add": {"shape": "sphere", "scale": number}}, {"unknown": 1}, number])
        text = json.dumps(whole)
        return draw.choice([text, text, text, text[:draw.randrange(1 + len(text))], "[" * 3000, "\xff" + text])
