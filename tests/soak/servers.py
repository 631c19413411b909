"""Attacks on commands that answer until they are stopped: `stream` and `live`."""

import contextlib
import http.client
import json
import pathlib
import socket
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

    def trial(self, draw):
        scene = self.jobs[0].folder.parent / "whole/samples/000000/scene.toml"
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        process = self.program.start(["live", scene, "--port", port, "--quiet"], self.folder,
                                     stdin=subprocess.DEVNULL)
        try:
            for _ in range(1200):  # until the seafloor is prepared
                with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1):
                    break
                time.sleep(0.1)
            paths = ["/", "/state", "/../etc/passwd", "/image", "/mesh", "/events", "/%00", "/" + "a" * 9000,
                     "//", "/state?x=" + "%ff" * 50]
            for _ in range(40):
                if draw.random() < 0.4:
                    with contextlib.suppress(OSError), \
                            socket.create_connection(("127.0.0.1", port), 1) as raw:
                        raw.sendall(draw.randbytes(draw.randint(1, 400)) +
                                    draw.choice([b"", b"\r\n\r\n", b" HTTP/1.1\r\nHost: x\r\n\r\n"]))
                    continue
                page = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
                with contextlib.suppress(TimeoutError):  # a stream of events does not end
                    page.request(draw.choice(["GET", "POST", "PUT", "HEAD", "OPTIONS"]), draw.choice(paths),
                                 headers={"Host": draw.choice([f"127.0.0.1:{port}", "example.org", ""])})
                    if page.getresponse().status >= 500:
                        raise Failed("an answer of 500 or more")
                page.close()
            if process.poll() is not None:
                raise Failed(f"ended with {process.returncode}: {process.stderr.read().decode()[-400:]}")
            page = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
            page.request("GET", "/")
            if page.getresponse().status != 200:
                raise Failed("the page is not answered after other requests")
        except (OSError, http.client.HTTPException) as problem:
            process.kill()
            raise Failed(f"{problem}; {process.stderr.read().decode()[-400:]}") from None
        finally:
            process.kill()
            process.communicate()
        return 40
