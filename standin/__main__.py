# SPDX-License-Identifier: Apache-2.0
"""`./kerf stand-in`: runs a program with kerf's libraries in place of those of a haptic device's vendor, over kerf-emulator,
and reports what the program did with them (docs/stand-ins.md).

    python3 standin FOLDER_OF_PROGRAMS FOLDER_OF_LIBRARIES [OPTION...] -- COMMAND...

Exit codes: that of the command; 1 if it succeeded and misused the device; 2 bad input or set-up."""
import ctypes
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import findings
from options import Refusal, parse

NAMES = {"libHD.so": ("libHD.so", "libHD.so.3.0", "libHD.so.3.4"),  # built library: the names that programs load
         "libdrd.so.3": ("libdrd.so", "libdrd.so.3", "libdhd.so", "libdhd.so.3")}
LINGER_S = 0.3  # three times the silence after which a device that drops its force does so
GRACE_S = 5  # for a program that is asked to end
PR_SET_CHILD_SUBREAPER = 36  # of <linux/prctl.h>
CALLED = "./kerf stand-in"  # the wheel is called otherwise (wheel/)


def say(line):
    who = "kerf: stand-in" if CALLED.startswith("./") else CALLED
    print(f"{who}: {line.replace('./kerf stand-in', CALLED)}", file=sys.stderr)


class Run:
    """One command, an emulator for each device, and a private folder for them. `end` leaves nothing behind."""

    def __init__(self, programs, libraries, options):
        self.programs, self.libraries, self.options = programs, libraries, options
        parent = os.environ.get("TMPDIR") or "/tmp"
        if "," in parent:  # it would end a path in KERF_STAND_IN
            raise Refusal(f"TMPDIR {parent}: has a comma, which divides the libraries' settings; set it to another folder")
        try:
            self.folder = tempfile.mkdtemp(prefix="kerf-stand-in.", dir=parent)
        except OSError:
            raise Refusal(f"{parent}: cannot be written; set TMPDIR to a folder that can") from None
        self.emulators, self.command = [], None
        self.limited = False  # ended by --seconds
        self.signalled = False  # by a terminal or another program

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def devices(self):
        """(number, device): the number is in the names of the device's files."""
        return enumerate(self.options.devices)

    @property
    def ledger(self):
        """Of what belongs to no device; a single device has it, too."""
        return self.path("ledger" if len(self.options.devices) > 1 else "ledger-0")

    def place_libraries(self):
        """Under every name that programs load, in the layout of a library path and of the vendor's SDK."""
        sdk = self.path("sdk", "lib", "release", "lin-x86_64-gcc")
        for folder in (self.path("lib"), sdk, os.path.join(sdk, "lib")):  # a client looks for a second lib in there
            os.makedirs(folder)
            for built, names in NAMES.items():
                source = os.path.join(self.libraries, built)
                if not os.path.exists(source):
                    raise Refusal(f"{source}: not built; try ./kerf setup")
                for name in names:
                    os.symlink(os.path.realpath(source), os.path.join(folder, name))

    def environment(self):
        options = self.options
        told = [f"program={self.ledger}", *["lockstep"] * options.lockstep]
        for number, device in reversed([*self.devices()]):
            told = [f"socket:{self.path(f'device-{number}')}", f"device={device.kind}", f"name={device.name}",
                    f"rate={device.rate_hz(options.lockstep)}", f"ledger={self.path(f'ledger-{number}')}", *told]
        if options.on_silence == "drop":
            told += ["missed=drop", "stop=drop"]
        paths = [self.path("lib"), os.environ.get("LD_LIBRARY_PATH", "")]
        return {**os.environ, "KERF_STAND_IN": ",".join(told + options.switches),
                "LD_LIBRARY_PATH": ":".join(filter(None, paths)),
                **{name: self.path("sdk") for name in ("FDSDK", "FORCEDIM_SDK", "FORCE_DIMENSION_SDK")}}

    def start_emulators(self):
        for number, device in self.devices():
            self.start_emulator(number, device)

    def start_emulator(self, number, device):
        options, place = self.options, self.path(f"device-{number}")
        rate_hz = device.rate_hz(options.lockstep)
        hand = device.hand or os.path.join(os.path.dirname(os.path.abspath(__file__)), "hand.toml")
        pace = ["--lockstep", "--rate", str(rate_hz)] if options.lockstep else \
            ["--packet-cycles", str(max(1, 8000 // max(rate_hz, 2000)))]
        limit = ["--seconds", options.seconds] if options.lockstep and options.seconds else []
        words = ["--personality", device.kind, "--front", "socket", "--socket", place, "--hand", hand, "--stay",
                 "--linger", str(LINGER_S), "--report", place + ".json", *pace, *limit,
                 *(["--fault", device.fault] if device.fault else []), *["--drop-torque"] * (options.on_silence == "drop")]
        with open(place + ".log", "wb") as log:
            emulator = subprocess.Popen(
                ["setpriv", "--pdeathsig", "TERM", os.path.join(self.programs, "kerf-emulator"), *words],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
        self.emulators.append(emulator)
        while not os.path.exists(place):
            if emulator.poll() is not None:
                lines = pathlib.Path(place + ".log").read_text(errors="replace").splitlines()
                raise Refusal(lines[-1].removeprefix("kerf-emulator: ") if lines else "kerf-emulator: ended without a word")
            time.sleep(0.005)

    def run_command(self):
        """Returns its exit code as a shell has it; 0 if --seconds ended it and it went at the first request."""
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)  # a process whose parent has ended becomes our child
        try:
            self.command = subprocess.Popen(self.options.command, env=self.environment())
        except OSError as error:
            raise Refusal(f"{self.options.command[0]}: cannot be started ({error.strerror}); name a program") from None
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, self.pass_on)
        limit = time.monotonic() + float(self.options.seconds) if self.options.seconds and not self.options.lockstep else None
        while self.command.poll() is None:
            time.sleep(0.02)
            gone = [emulator for emulator in self.emulators if emulator.poll() is not None]  # in lock-step its time is over
            if gone and not (self.options.lockstep and self.options.seconds and gone[0].returncode == 0):
                self.ask_to_end(0)
                raise Refusal(f"kerf-emulator ended (exit code {gone[0].returncode}) before the program; start it again")
            if gone or limit is not None and time.monotonic() >= limit:
                self.ask_to_end(GRACE_S if gone else 0)
        if self.signalled:
            self.ask_to_end(GRACE_S)  # the rest of it
        code = self.command.returncode
        if self.limited and code in (0, 130, -signal.SIGINT):
            return 0
        return code if code >= 0 else 128 - code

    def pass_on(self, number, _frame):
        self.signalled = True
        if number != signal.SIGINT:  # a terminal has sent it to the command, too
            self.send(number)

    def processes(self):
        """(process, its group) of all that the command consists of and that run, a parent before its children."""
        children = {}
        for name in filter(str.isdigit, os.listdir("/proc")):
            try:
                state, parent, group = pathlib.Path("/proc", name, "stat").read_bytes().rpartition(b") ")[2].split()[:3]
            except OSError:  # it has ended
                continue
            if state not in b"ZX":
                children.setdefault(int(parent), []).append((int(name), int(group)))
        found, parents, own = [], [os.getpid()], [emulator.pid for emulator in self.emulators]
        for parent in parents:
            below = [child for child in children.get(parent, []) if child[0] not in own]
            found += below
            parents += [process for process, _ in below]
        return found

    def send(self, number):
        """SIGINT as Ctrl-C in a terminal: a shell waits for its child and does not pass it on; a wrapper with a group of its own
        does. Any other signal to each process."""
        for process, group in self.processes():
            if number != signal.SIGINT or group == os.getpgrp() or process == self.command.pid:
                try:
                    os.kill(process, number)
                except OSError:  # it has ended, or belongs to another user
                    pass

    def ask_to_end(self, patience_s):
        """After some time in which it may end by itself. Returns once all of its processes have."""
        requests = [(number, GRACE_S) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)]
        for number, patience in [(None, patience_s), *requests]:
            if number is not None:
                if self.command.poll() is None:
                    self.limited = number == signal.SIGINT
                self.send(number)
            end = time.monotonic() + patience
            while self.command.poll() is None or self.processes():
                if time.monotonic() >= end:
                    break
                time.sleep(0.02)
            else:
                return

    def emulator_reports(self):
        for emulator in self.emulators:
            if emulator.poll() is None:
                emulator.terminate()
        try:
            for emulator in self.emulators:
                emulator.wait(10)
            return [json.loads(pathlib.Path(self.path(f"device-{number}.json")).read_text()) for number, _ in self.devices()]
        except (OSError, ValueError, subprocess.TimeoutExpired):
            raise Refusal("kerf-emulator left no report, so nothing is known of the device; start it again") from None

    def end(self):
        if self.command is not None and self.command.poll() is None:
            self.send(signal.SIGKILL)
            self.command.wait()
        for emulator in self.emulators:
            if emulator.poll() is None:
                emulator.kill()
                emulator.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def run(programs, libraries, options):
    run = Run(programs, libraries, options)
    try:
        run.place_libraries()
        run.start_emulators()
        code = run.run_command()
        emulators = run.emulator_reports()
        program = findings.read_ledger(run.ledger)
        devices = [findings.of_device(device, device.rate_hz(options.lockstep), findings.read_ledger(run.path(f"ledger-{number}")),
                                      program, emulators[number]) for number, device in run.devices()]
    finally:
        run.end()
    report = findings.findings(devices, program, {
        "command": options.command, "exit_code": code, "lockstep": options.lockstep, "on_silence": options.on_silence,
        "switches": options.switches})
    for path, write in ((options.report, findings.write_json), (options.junit, findings.write_junit)):
        if path:
            try:
                write(path, report)
            except OSError as error:
                raise Refusal(f"{path}: cannot be written ({error.strerror}); name another file") from None
    for line in findings.summary(report):
        say(line)
    return code or int(bool(report["misuse"]))


def main(arguments):
    programs, libraries, *words = arguments
    try:
        return run(programs, libraries, parse(words, libraries))
    except (Refusal, ValueError) as refusal:
        say(re.sub(r"[\x00-\x1f\x7f]", "?", str(refusal)))
        return 2
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
