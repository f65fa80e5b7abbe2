# SPDX-License-Identifier: Apache-2.0
"""The guided part of `./kerf identify --scene`: a controller, its recorder and, without --port, an emulated device; the motion of
experiment.py as a force of a program, within the scene's limits; the recording of it. Whatever ends it, the controller switches
the motors off, and the recording is kept.

Nothing is assumed of real time: what a tick got is in the log, whenever it was computed."""
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from experiment import ENDS_S, MOST_MM, SECONDS, STAGES, Experiment

PATIENCE_S = 10.0     # for programs to start; a device may take as long as its user wants
EMULATED_S = 15.0     # an emulated one does not
HAND = "let_go.toml"  # beside this file: the emulated hand takes the device, and then hardly holds it
WHAT = {"rest": "at rest", "swing": "many sines on all axes", "steps": "steps of a spring's goal", "slow": "to and fro, slowly and faster",
        "high": "chirps up to 420 Hz"}


class Stopped(Exception):
    """One line: why there is no whole recording."""


class Refused(Exception):
    """One line: place, value, way out."""


class Interrupt:
    """Ctrl-C, and the signals that ask a program to end: the motion stops in between two ticks."""

    def __init__(self):
        self.by = None
        self.before = {number: signal.signal(number, self._take) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}

    def _take(self, number, _frame):
        self.by = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name

    def give_back(self):
        for number, handler in self.before.items():
            signal.signal(number, handler)


class Programs:
    """Controller, recorder and emulator; their words in files of `folder`. `end` leaves no process behind."""

    def __init__(self, binaries, folder):
        self.binaries, self.folder, self.started = binaries, folder, []

    def start(self, name, *words):
        with open(os.path.join(self.folder, name + ".txt"), "wb") as said:
            process = subprocess.Popen(["setpriv", "--pdeathsig", "TERM", os.path.join(self.binaries, "kerf-" + name), *map(str, words)],
                                       stdin=subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT, start_new_session=True)
        self.started.append(process)
        return process

    def last_line(self, name):
        try:
            with open(os.path.join(self.folder, name + ".txt"), errors="replace") as said:
                lines = said.read().split("\n")
        except OSError:
            return ""
        return next((line.strip() for line in reversed(lines) if line.strip()), "")

    def end(self):
        """The controller first: it switches the motors off and reports; the recorder ends with it."""
        for process in self.started:
            if process.poll() is None and process is self.started[0]:
                process.send_signal(signal.SIGINT)
                _wait(process, 3)
        for process in self.started[1:]:
            _wait(process, 3)
        for process in self.started:
            if process.poll() is None:
                process.kill()
                process.wait()


def _wait(process, seconds):
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        process.terminate()


def checked(binaries, words):
    """The settings of a scene, as `kerf-controller --check` prints them. Raises Refused with its line."""
    done = subprocess.run([os.path.join(binaries, "kerf-controller"), *words, "--check"], capture_output=True, text=True, check=False)
    if done.returncode:
        lines = (done.stderr or done.stdout).strip().splitlines()
        raise Refused(lines[-1].removeprefix("kerf-controller: ") if lines else f"kerf-controller ended with exit code {done.returncode}")
    told = {key: value.strip('"') for key, _, value in (line.partition("=") for line in done.stdout.splitlines())}
    if told.get("force") != "external":
        raise Refused(f"--scene {words[1]}: its force.model is \"{told.get('force')}\", and the motion is a force of a program; give --scene external")
    if "device" in told and "second_device" in told:
        raise Refused(f"--scene {words[1]}: has two devices; give a scene with the one to identify")
    return told


def emulated_scale(binaries, personality):
    done = subprocess.run([os.path.join(binaries, "kerf-emulator"), "--personality", personality, "--describe"], capture_output=True, text=True,
                          check=True)
    return done.stdout.strip().removeprefix("torque_scale=")


class Motion:
    """The experiment for one device, by its states: what to give in each tick."""

    def __init__(self, limit_n, most_stiffness, most_damping, scale):
        import numpy as np
        self.np, self.scale = np, scale
        self.experiment = Experiment(np.array([limit_n]), most_stiffness, most_damping)
        self.begin = self.start_mm = None
        self.stage = -1

    def seconds(self, tick, period_s):
        return (tick - self.begin) * period_s

    def give(self, device, state):
        """Returns a stage's number when it begins, else None."""
        if self.begin is None:
            self.begin, self.start_mm = state.tick, self.np.array(state.position_mm)
        seconds = self.seconds(state.tick, device.period_s)
        place_mm = (self.np.array(state.position_mm) - self.start_mm) / self.scale
        force, goal, stiffness, damping = self.experiment.ask(seconds, place_mm[None, :])
        device.give(force_n=tuple(force[0]), goal_mm=tuple(self.start_mm + goal[0] * self.scale), stiffness_n_per_mm=float(stiffness[0, 0]),
                    damping_ns_per_mm=float(damping[0, 0]))
        stage = self.experiment.stage_at(seconds)
        if stage == self.stage:
            return None
        self.stage = stage
        return stage


def move(device, motion, interrupt, controller_says, say, progress, seconds, patience_s):
    """From the first state with the motors on to the end. Raises Stopped."""
    import kerf
    on = (kerf.Phase.RAMPING, kerf.Phase.ACTIVE)
    since, told = time.monotonic(), ""
    while True:
        if interrupt.by:
            raise Stopped(f"stopped by {interrupt.by}{_after(motion, device)}: the motors are off")
        if not device.wait():
            raise Stopped(f"the controller ended{_after(motion, device)}, and switched the motors off")
        state = device.state()
        if motion.begin is None:
            if state.phase == kerf.Phase.ACTIVE:
                motion.give(device, state)
            elif time.monotonic() - since > patience_s:
                raise Stopped(f"the device was not ready within {patience_s:.0f} s: {controller_says()}")
            elif (line := controller_says()) != told and "waiting" in line:
                told = line
                say(told.removeprefix("kerf-controller: "))
            continue
        if state.phase not in on:
            why = f"a fault, {state.fault}," if state.fault != "none" else "the device, which was put back,"
            raise Stopped(f"{why} switched the motors off{_after(motion, device)}")
        at = motion.seconds(state.tick, device.period_s)
        if at >= seconds:
            return
        stage = motion.give(device, state)
        if stage is not None:
            name = STAGES[stage]
            what = WHAT.get(name, f"a force that rises along {name[-1]} until the tip moves")
            end = min(ENDS_S[stage], seconds)
            progress.stage(f"{what}, to {end:.0f} s")
        progress.at(at / seconds)


def _after(motion, device):
    if motion.begin is None:
        return " before the motors were on"
    return f" {motion.seconds(device.state().tick, device.period_s):.1f} s into the motion"


class Progress:
    """A line for each stage; on a terminal a bar in one line."""

    def __init__(self, say):
        self.say, self.bar, self.text, self.shown = say, sys.stdout.isatty(), "", -1

    def stage(self, text):
        self.text = text
        if not self.bar:
            self.say(text)

    def at(self, part):
        percent = int(100 * part)
        if not self.bar or percent == self.shown:
            return
        self.shown = percent
        print(f"\r\033[Kkerf: identify: [{'#' * (percent // 4):25}] {percent} % {self.text}", end="", flush=True)

    def end(self):
        if self.bar and self.shown >= 0:
            print(flush=True)


def explain(say, told, options, seconds):
    """Before anything moves."""
    what = told["device.personality"]
    say(f"{what} at --port {options.port}" if options.port else f"an emulated {what}; --port PORT: a real one (docs/first-hour.md)")
    say(f"the device will move by itself for {seconds:.0f} s, by at most {float(told['limits.force_n']):g} N: free {MOST_MM:.0f} mm around its tip")
    say("take it out of its dock, to the middle of its workspace, and let go: hands off while it moves")
    say("to stop it: Ctrl-C; you may also grasp it; those seconds are lost")


def record(binaries, options, seconds=SECONDS):
    """Moves the device and records it in options.log, a new folder; returns the seconds that were moved. Raises Refused, Stopped."""
    import kerf
    def say(text):
        print("kerf: identify: " + text, flush=True)
    scene = ["--scene", options.scene, *(["--device", options.device] if options.device else [])]
    told = checked(binaries, scene)
    if options.port and "device.torque_scale" not in told:
        raise Refused(f"--scene {options.scene}: no device.torque_scale, so the motors stay off; add it (docs/first-hour.md)")
    explain(say, told, options, seconds)
    if options.port and sys.stdin.isatty() and sys.stdout.isatty():
        try:
            input("kerf: identify: press Enter to begin ")
        except EOFError:
            raise Stopped("stopped before it began: nothing moved") from None
    folder = tempfile.mkdtemp(prefix="kerf-identify.")
    name = f"identify-{os.getpid()}"
    programs, interrupt = Programs(binaries, folder), Interrupt()
    progress = Progress(say)
    try:
        personality, socket = told["device.personality"], os.path.join(folder, "device")
        where = ["--port", options.port]
        if not options.port:
            where = ["--port", f"socket:{socket}", "--torque-scale", emulated_scale(binaries, personality)]
        programs.start("controller", *scene, *where, "--name", name)
        recorder = programs.start("recorder", "--name", name, "--out", options.log)
        if not options.port:
            identified = ["--identified", told["identified"]] if told.get("identified") else []
            programs.start("emulator", "--personality", personality, "--socket", socket, *identified, "--hand",
                           os.path.join(os.path.dirname(os.path.abspath(__file__)), HAND), "--unit-mm", "1")
        device = _opened(kerf, name, programs, interrupt)
        try:
            motion = Motion(float(told["limits.force_n"]), float(told["force.stiffness_n_per_mm"]), float(told["force.damping_ns_per_mm"]),
                            device.workspace_scale)
            move(device, motion, interrupt, lambda: programs.last_line("controller"), say, progress, seconds,
                 float("inf") if options.port else EMULATED_S)
        finally:
            progress.end()
            device.close()
        programs.end()
        if recorder.returncode:
            raise Stopped(f"nothing was recorded: {programs.last_line('recorder')}")
    finally:
        programs.end()
        interrupt.give_back()
        shutil.rmtree(folder, ignore_errors=True)
    say(f"the motors are off; recorded in {options.log}")


def _opened(kerf, name, programs, interrupt):
    """The device once its controller is there."""
    end = time.monotonic() + PATIENCE_S
    while True:
        if interrupt.by:
            raise Stopped(f"stopped by {interrupt.by} before the motors were on: they are off")
        for process, program in zip(programs.started, ("controller", "recorder", "emulator")):
            if process.poll():
                raise Refused(programs.last_line(program).removeprefix(f"kerf-{program}: "))
        try:
            return kerf.Device(name)
        except kerf.Error as error:
            if time.monotonic() > end:
                raise Stopped(f"no device within {PATIENCE_S:.0f} s: {error}") from None
        time.sleep(0.02)
