"""Attacks on commands that write: signals, failing calls, little memory or disk, company."""

import contextlib
import errno
import os
import resource
import shutil
import signal
import subprocess

from attack import EXIT_CODES, NOT_BEGUN, Failed, Row, tree

MB = 1 << 20


class Kills(Row):
    title = "SIGKILL at any time, then the same command again: the same bytes, nothing left over"
    unit = "kills"

    def trial(self, draw):
        job = draw.choice([j for j in self.jobs if j.name != "stream"])
        job.clear()
        kills = 0
        for _ in range(draw.randint(1, 4)):
            code, _, err = self.program.run(job.args, job.folder,
                                            stop=(signal.SIGKILL, draw.uniform(0, job.seconds)))
            if code not in (-signal.SIGKILL, 0):
                raise Failed(f"{job.name}: exit code {code}; {err.strip()[-400:]}")
            kills += code != 0
        job.finish()
        return kills


class Terminations(Row):
    title = "SIGTERM at any time: ends within 10 s, and the same command completes the work"

    def trial(self, draw):
        job = draw.choice([j for j in self.jobs if j.name != "stream"])
        job.clear()
        code, _, err = self.program.run(job.args, job.folder, timeout_s=10,
                                        stop=(signal.SIGTERM, draw.uniform(0, job.seconds)))
        if code not in (0, 75, -signal.SIGTERM, 128 + signal.SIGTERM):
            raise Failed(f"{job.name}: exit code {code}; {err.strip()[-400:]}")
        job.finish()
        return 1


class FailingCalls(Row):
    title = "the k-th call of open, read, write, fsync, rename, mmap or malloc fails, with any of its errors"
    # What Linux documents for them, and what a network disk adds. Left out: errors that say what
    # lies at a place (ENOTEMPTY, EISDIR ...), because the program acts on that.
    network = "EIO ESTALE ETIMEDOUT"
    opening = f"EACCES EINTR ELOOP EMFILE ENFILE ENODEV ENOMEM ENXIO EOVERFLOW EPERM {network}"
    errors = {
        "open": f"EBUSY EDQUOT ENOSPC EROFS ETXTBSY {opening}",
        "open_read": opening,
        "read": f"EAGAIN EINTR {network}",
        "write": f"EAGAIN EDQUOT EFBIG EINTR ENOSPC EPERM {network}",
        "fsync": f"EDQUOT EINTR ENOSPC EROFS {network}",
        "rename": f"EACCES EBUSY EDQUOT EINVAL ELOOP EMLINK ENOMEM ENOSPC EPERM EROFS EXDEV {network}",
        "mmap": "EACCES EAGAIN EINVAL ENFILE ENODEV ENOMEM EOVERFLOW EPERM",
        "malloc": "ENOMEM",
    }

    def __init__(self, *args):
        super().__init__(*args)
        self.counts = {}

    def count(self, job, call):
        """How often a job makes this call."""
        if (job.name, call) not in self.counts:
            file = self.folder / "calls"
            file.write_text("0")
            job.clear()
            job.finish(fail={"FAIL_CALL": call, "CALLS_FILE": file})
            self.counts[job.name, call] = int(file.read_text())
        return self.counts[job.name, call]

    def trial(self, draw):
        job = draw.choice(self.jobs)
        call = draw.choice([c for c in self.errors if self.count(job, c)])
        at = draw.randint(1, self.count(job, call))
        error = getattr(errno, draw.choice(self.errors[call].split()))
        job.clear()
        try:
            job.attempt(fail={"FAIL_CALL": call, "FAIL_AT": at, "FAIL_ERRNO": error})
            if job.name != "stream":
                job.finish()
        except Failed as failed:
            raise Failed(f"call {at} of {call} ({os.strerror(error)}): {failed}") from None
        return 1


class LittleMemory(Row):
    title = "address space limited to 100 MB and more"

    def trial(self, draw):
        job = draw.choice(self.jobs)
        most = int(100 * MB * 40 ** draw.random())
        job.clear()
        try:
            if job.attempt(limits=[(resource.RLIMIT_AS, most)]) == NOT_BEGUN:
                return 0
            job.finish()
        except Failed as failed:
            raise Failed(f"{most >> 20} MB: {failed}") from None
        return 1


class LittleDisk(Row):
    title = "files limited in size, or a disk that is full"

    def trial(self, draw):
        job = draw.choice([j for j in self.jobs if j.name != "stream"])
        job.clear()
        if draw.random() < 0.5 or os.geteuid() != 0:
            most = int(2 ** draw.uniform(6, 20))
            try:
                job.attempt(limits=[(resource.RLIMIT_FSIZE, most)])
                job.finish()
            except Failed as failed:
                raise Failed(f"files of {most} bytes: {failed}") from None
            return 1
        out = job.folder / "out"
        most = 4 * draw.randint(1, 300)
        if subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={most}k", "none", out],
                          stderr=subprocess.DEVNULL).returncode != 0:
            return 0  # not allowed in most containers
        try:
            if job.inputs:
                with contextlib.suppress(shutil.Error, OSError):
                    shutil.copytree(job.inputs, out, dirs_exist_ok=True)
                if tree(out) != tree(job.inputs):
                    return 0
            job.attempt()
            subprocess.run(["mount", "-o", "remount,size=1g", out], check=True)
            job.finish()
        except Failed as failed:
            raise Failed(f"a disk of {most} kB: {failed}") from None
        finally:
            subprocess.run(["umount", out], check=True)
        return 1


class Together(Row):
    title = "two or eight processes in one folder, with one cache"
    unit = "processes"

    def trial(self, draw):
        job = draw.choice([j for j in self.jobs if j.name != "stream"])
        job.clear()
        together = [self.program.start(job.args, job.folder, stdin=subprocess.DEVNULL)
                    for _ in range(draw.choice([2, 8]))]
        for process in together:
            _, err = process.communicate(timeout=300)
            if process.returncode not in EXIT_CODES:
                raise Failed(f"{job.name}: exit code {process.returncode}; {err.decode()[-400:]}")
        job.finish()
        return len(together)


class SameBytes(Row):
    title = "the same bytes with any number of threads, locale, time zone, umask, jumping clock, " \
            "cold and warm cache"
    locales = ("de_DE.UTF-8", "tr_TR.UTF-8")

    def __init__(self, *args):
        super().__init__(*args)
        for name in self.locales:
            if not (self.folder / name).exists():
                subprocess.run(["localedef", "-i", name.split(".")[0], "-f", "UTF-8", self.folder / name],
                               check=True)

    def trial(self, draw):
        job = draw.choice(self.jobs)
        job.clear()
        env = {"LC_ALL": draw.choice(["C", "C.UTF-8", *self.locales]), "LOCPATH": str(self.folder),
               "TZ": draw.choice(["UTC", "Asia/Kathmandu", "America/St_Johns", "Pacific/Kiritimati"]),
               "OMP_NUM_THREADS": str(draw.randint(1, 8))}
        fail = {"CLOCK_JUMP": draw.choice([0, 3600, 400000])}
        umask = draw.choice([0o022, 0o077, 0o002])
        threads = draw.choice([1, 2, 3, 5])
        args = job.args
        if job.name.startswith("run") or job.name == "generate":
            args = [*[a for a in args if a not in ("--threads", "2")], "--threads", threads]
        before = os.umask(umask)
        try:
            for _ in range(draw.randint(1, 2)):
                code, out = self.program.check(args, job.folder, text=job.text, env=env, fail=fail,
                                               codes={0})
                job.check_output(out)
        except Failed as failed:
            raise Failed(f"{env}, {threads} threads, umask {umask:o}, {fail}: {failed}") from None
        finally:
            os.umask(before)
        return 1
