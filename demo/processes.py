# SPDX-License-Identifier: Apache-2.0
"""The programs of a demo as processes: started, watched, ended."""
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from options import Refusal

# Signals that would end the demo and leave its files and programs; the last are the real-time signals.
END = [getattr(signal, "SIG" + name) for name in "TERM HUP QUIT ALRM USR1 USR2 VTALRM PROF IO PWR STKFLT XCPU".split()
       if hasattr(signal, "SIG" + name)] + list(range(34, 65))


def say(text, stream=None):
    """Prints a line; a reader or a terminal that is gone is no error."""
    stream = stream or sys.stdout
    try:
        print(text, file=stream, flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def complain(text):
    say(text, sys.stderr)


def exit_code(process):
    """As a shell has it: 128 and the signal after a crash."""
    code = process.returncode
    return 128 - code if code < 0 else code


def memory_limit_mib():
    """Of each process (ulimit -v); None without one."""
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else limit >> 20


def crashed(name, code):
    """Reports an end that is not one of kerf's own exit codes, in one line, and returns whether it is one."""
    if code <= 2:
        return False
    how = f"by signal {code - 128}" if code > 128 else f"with exit code {code}"
    limit = memory_limit_mib()
    if limit is None:
        complain(f"kerf: demo: {name}: ended {how}")
    else:  # a library that gets no memory may end a program in any way
        complain(f"kerf: demo: {name}: ended at a memory limit of {limit} MiB ({how}); raise it: ulimit -v")
    return True


class Processes:
    """Starts programs from `folder`; their logs and sockets lie in `run`, a private folder. `shown`: (path, its name for the user)
    for messages. Whatever ends the demo must call `end`."""

    def __init__(self, folder, shown, keep_open=()):
        self.folder, self.shown, self.keep_open = folder, shown, keep_open
        self.started = []
        parent = os.environ.get("TMPDIR") or "/tmp"
        try:
            self.run = tempfile.mkdtemp(prefix="kerf-demo.", dir=parent)
        except OSError:
            raise Refusal(f"{parent}: cannot be written; set TMPDIR to a folder that can") from None

    def path(self, name):
        return os.path.join(self.run, name)

    def start(self, name, arguments, out=None, log=None):
        """Its own session keeps a Ctrl-C from it; the kernel ends it if this process is killed. `out`, `log`: files in `run`
        for its standard output and errors."""
        command = ["setpriv", "--pdeathsig", "TERM", os.path.join(self.folder, "kerf-" + name), *map(str, arguments)]
        return self.popen(command, out, log, start_new_session=True, pass_fds=self.keep_open)

    def popen(self, command, out=None, log=None, **options):
        stdout = open(self.path(out), "wb") if out else None
        stderr = stdout if log and log == out else open(self.path(log), "wb") if log else None
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=stdout, stderr=stderr, **options)
        finally:
            for file in {stdout, stderr} - {None}:
                file.close()
        self.started.append(process)
        return process

    def report(self, name):
        """Prints the last line of the log of a program that did not end well, in the user's own terms."""
        try:
            lines = pathlib.Path(self.path(name + ".log")).read_text(errors="replace").splitlines()
        except OSError:
            lines = []
        line = lines[-1] if lines else f"kerf: demo: {name}: ended without a word"
        limit = memory_limit_mib()
        if limit is not None and "ulimit" not in line:
            line += f"; memory is limited to {limit} MiB, which may be the reason: ulimit -v"
        complain(line.replace(*self.shown))

    def conclude(self, name, process, seconds):
        """Waits so long for the program to end, reports if it did not end well, and returns its exit code."""
        end = time.monotonic() + seconds
        while process.poll() is None and time.monotonic() < end:
            time.sleep(0.02)
        if process.poll() is None:
            complain(f"kerf: demo: {name}: still busy after {seconds} s; ended by force")
            process.kill()
            process.wait()
            return 1
        code = exit_code(process)
        if code == 0:
            return 0
        if crashed(name, code):
            return 1
        self.report(name)
        return code

    def end(self):
        """Leaves no process and no file of this demo behind."""
        for one in self.started:
            if one.poll() is None:
                one.terminate()
        deadline = time.monotonic() + 2
        while any(one.poll() is None for one in self.started) and time.monotonic() < deadline:
            time.sleep(0.02)
        for one in self.started:
            if one.poll() is None:
                one.kill()
                one.wait()
        self.remove_run()

    def remove_run(self):
        bus = self.path("bus")
        if os.path.isdir(bus):  # an emulator that was killed leaves its folder mounted
            subprocess.run(["umount", "-l", bus], stderr=subprocess.DEVNULL, check=False)
        shutil.rmtree(self.run, ignore_errors=True)


def terminate(*processes):
    for process in processes:
        if process is not None and process.poll() is None:
            process.terminate()
