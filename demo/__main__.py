# SPDX-License-Identifier: Apache-2.0
"""`./kerf demo`: an emulated hand mills a tooth, from device bytes to pictures. This runs controller, emulator, recorder,
visualizer and bridge together, and keeps their results.

    python3 demo FOLDER_OF_PROGRAMS PATH_OF_KERF [OPTION...]

Exit codes: 0 fine; 1 ran, and a check failed or a program crashed; 2 bad input or set-up; 130, 143 stopped by a signal."""
import importlib.util
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import time

import options as demo_options
from options import BUSES, PICTURE_SIZE, Refusal
from out_folder import OutFolder
from processes import END, Processes, complain, crashed, exit_code, say, terminate

FRAMES = 12
PATIENCE_S = 3  # a short run waits so long for its pictures to begin


class Demo:
    def __init__(self, programs, kerf, options):
        self.programs, self.kerf, self.options = programs, kerf, options
        self.root = os.path.dirname(kerf)
        self.scene = self.find_scene(options.scene or "phantom")
        self.out = self.processes = None
        self.controller = self.emulator = self.second = self.kerf_arm = self.recorder = self.window = self.pictures = self.bridge = None
        self.code_of_signal = None
        self.finishing = False  # the results are being kept: a signal is too late

    def find_scene(self, name):
        """The file of that name; else that of kerf's own scenes, with or without their folder and the ending."""
        shipped = os.path.join(self.root, "scenes")
        for path in (name, os.path.join(self.root, name), os.path.join(shipped, name), os.path.join(shipped, name + ".toml")):
            if os.path.isfile(path):
                if path != name != "phantom":
                    say(f"kerf: demo: --scene {name}: {path}")
                return path
        return name

    # -- signals

    def watch_signals(self):
        for number in [signal.SIGINT, *END]:
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self.on_signal)

    def on_signal(self, number, _frame):
        """The controller switches the motors off and reports, and the others follow it. The second signal, or one before
        there is a hand, ends everything at once."""
        if self.finishing:
            return
        if self.code_of_signal is not None:
            sys.exit(self.code_of_signal)
        self.code_of_signal = 130 if number == signal.SIGINT else 143
        if self.emulator is None:
            sys.exit(self.code_of_signal)
        terminate(self.controller)

    # -- the parts of a demo

    def run(self):
        """Returns the exit code."""
        has_sources = os.path.exists(os.path.join(self.root, "standin", "CMakeLists.txt"))
        demo_options.choose_devices(self.options, self.scene)
        demo_options.choose_port(self.options, os.path.join(os.path.dirname(self.programs), "stand-in") if has_sources else "")
        demo_options.check(self.options)
        if self.options.out:
            self.out = OutFolder(self.options.out)
            self.out.check()
        self.build()
        os.umask(os.umask(0o077) & 0o077)  # as the programs: the user keeps all rights of his own
        self.watch_signals()
        try:
            return self.run_programs()
        finally:
            for number in [signal.SIGINT, *END]:
                signal.signal(number, signal.SIG_IGN)
            if self.processes:
                self.processes.end()
            if self.out:
                self.out.close()

    def build(self):
        if self.options.two_machines and not os.path.exists(os.path.join(self.root, "CMakeLists.txt")):
            raise Refusal("--two-machines: this kerf is installed; a clone of its sources has that")
        names = ["controller", "emulator", "visualizer", "recorder", "record"]
        names += ["arm"] * (self.options.port == "arm") + ["stand-in"] * self.options.stand_in
        names += ["bridge"] * (self.options.serve or self.options.two_machines) + ["studies"] * self.options.two_machines
        code = subprocess.run([self.kerf, "_programs", *names], check=False).returncode
        if code:
            sys.exit(code if code > 0 else 128 - code)
        if "bridge" in names and not os.access(os.path.join(self.programs, "kerf-bridge"), os.X_OK):
            raise Refusal(("--serve" if self.options.serve else "--two-machines")
                          + ": kerf-bridge was not built, for want of a library; try ./kerf setup")

    def run_programs(self):
        options = self.options
        if self.out:
            rate_hz = demo_options.expected_rate_hz(options, self.scene)
            self.out.open(float(options.seconds) * demo_options.log_bytes_per_s(options, rate_hz))
            self.results, keep_open = self.out.results, (self.out.lock,)
        else:
            self.results, keep_open = None, ()
        shown = (self.results or "\0", options.out or "its folder")
        self.processes = Processes(self.programs, shown, keep_open)
        if not self.results:
            self.results = self.processes.path("results")
            os.mkdir(self.results)
            self.processes.shown = (self.results, "its folder")
        if options.two_machines:
            return self.run_two_machines()
        self.name = options.name or f"demo-{os.getpid()}"
        self.find_meeting_point()
        if options.bound_is_told:
            say(f"kerf: demo: runs for {options.seconds} s; --seconds N: another time")
        if options.serve:
            self.start_bridge()
        self.start_controller()
        if self.told.exists():
            self.start_others()
        failed, cut = self.watch()
        return self.finish(failed, cut)

    def run_two_machines(self):
        """`kerf-studies two-machines` makes the networks and starts all parts on them."""
        options = self.options
        words = [f"--controller-word={word}" for word in [*options.volume, *(["--rate", options.rate] if options.rate else [])]]
        look = [*options.look, *options.screen, *(["--record", options.record] if options.record else []),
                *(["--sheet", options.sheet] if options.sheet else [])]
        words += [f"--visualizer-word={word}" for word in look]
        hand = ["--hand", options.hand] if options.hand else []
        self.controller = self.emulator = self.processes.start("studies", [
            "two-machines", "--scene", self.scene, "--device", options.device, *hand, "--seconds", options.seconds,
            *(["--size", options.size] if options.size else []), *options.link, *["--headless"] * options.headless, *words,
            *(["--out", self.results] if self.out else [])])  # it speaks for itself
        code = self.controller.wait()
        if code == 77 or code == 2:
            return self.code_of_signal or code
        if self.code_of_signal is None and crashed("studies", exit_code(self.controller)):
            code = 1
        self.finishing = True
        code = self.keep(code)
        return code if self.code_of_signal is None else self.code_of_signal

    def find_meeting_point(self):
        """`meet`, a path or an address, is there once the emulator is ready; `ask` and `offer` are the options of controller and
        emulator for it."""
        options, processes = self.options, self.processes
        self.meet = processes.path("device")
        self.ask, self.offer = ["--port", "socket:" + self.meet], ["--front", "socket", "--socket", self.meet]
        if options.port == "arm":  # the emulator stands behind the library that kerf-arm loads
            self.ask = ["--port", "arm:" + self.name]
            if options.device not in demo_options.STAND_INS:  # or is the service; both sides must know its port beforehand
                with socket.socket() as free:
                    free.bind(("127.0.0.1", 0))
                    self.meet = free.getsockname()
                self.offer = ["--front", "websocket", "--ws", self.service()]
        elif options.port != "socket":
            bus = processes.path("bus")
            os.mkdir(bus)
            self.meet = os.path.join(bus, BUSES[options.device][1])
            self.ask, self.offer = ["--port", f"{options.port}:{self.meet}"], ["--front", "fuse", "--mount", bus]
        if options.port == "usb":  # the emulated Falcon accepts any bytes as its firmware
            firmware = pathlib.Path(processes.path("firmware"))
            firmware.write_bytes(pathlib.Path(self.kerf).read_bytes()[:1000])
            self.ask = ["--port", f"usb:{self.meet},firmware={firmware}"]
        if options.second:
            self.ask += ["--port", "socket:" + processes.path("device-2")]
        # The emulated motors are known; a scene has no torque scale, because a real device's is unknown.
        self.ask += ["--torque-scale", ",".join(self.torque_scale(device) for device in (options.device, options.second) if device)]

    def torque_scale(self, device):
        described = subprocess.run([os.path.join(self.programs, "kerf-emulator"), "--personality", device, "--describe"],
                                   stdout=subprocess.PIPE, text=True, check=False)
        if described.returncode:
            sys.exit(1 if crashed("emulator", exit_code(described)) else 2)
        return described.stdout.strip().removeprefix("torque_scale=")

    def start_bridge(self):
        """Before its controller. Each browser gets an address of its own, so `tail` prints those to come, too."""
        processes = self.processes
        qr = ["--qr"] if sys.stdout.isatty() else []
        self.bridge = processes.start("bridge", ["serve", "--name", self.name, "--listen", self.options.listen or "127.0.0.1:0", *qr],
                                      out="bridge.said", log="bridge.log")
        said = pathlib.Path(processes.path("bridge.said"))
        while self.bridge.poll() is None and "token=" not in said.read_text(errors="replace"):
            time.sleep(0.05)
        if self.bridge.poll() is not None:
            code = processes.conclude("bridge", self.bridge, 0)
            if code:
                sys.exit(code)
        processes.popen(["tail", "-n", "+1", "-f", f"--pid={self.bridge.pid}", str(said)])

    def start_controller(self):
        """It loads the scene and writes what the emulator has to know."""
        options, processes = self.options, self.processes
        self.told = pathlib.Path(processes.path("emulator-args"))
        self.lead = []
        until = []
        if options.virtual and (options.headless or options.out):  # else it is over before a picture
            os.mkfifo(processes.path("lead"))
            until, self.lead = ["--until", processes.path("lead")], ["--lead", processes.path("lead")]
        if options.virtual:
            os.mkfifo(processes.path("log-lead"))
            until += ["--until", processes.path("log-lead")]
        device = [] if options.second not in ("", options.device) else ["--device", options.device]
        self.controller = processes.start("controller", [
            "--scene", self.scene, *options.volume, *device, *self.ask, "--seconds", options.seconds,
            *(["--rate", options.rate] if options.rate else []), "--name", self.name,
            *(["--virtual"] if options.virtual else []), *(["--pedal"] if options.mouse else []), *until, *(["--progress"] if sys.stdout.isatty() else []),
            "--emulator-args", self.told, "--report", os.path.join(self.results, "report.json"),
            "--final", os.path.join(self.results, "final.nrrd")], out="summary")
        while not self.told.exists() and self.controller.poll() is None:
            time.sleep(0.005)

    def start_others(self):
        options, processes = self.options, self.processes
        told = dict(line.split("=", 1) for line in self.told.read_text().splitlines() if "=" in line)
        rate_hz = int(told.get("rate_hz", 1000))
        for line in demo_options.growth(options, rate_hz):
            say("kerf: demo: " + line)
        lead = ["--lead", processes.path("log-lead")] if options.virtual else []
        self.recorder = processes.start("recorder", ["--name", self.name, "--out", os.path.join(self.results, "log"), *lead],
                                        out="recorder.log", log="recorder.log")
        hand = self.hand(told)
        self.start_pictures(rate_hz)
        if options.virtual or options.record or int(options.seconds.split(".")[0]) < PATIENCE_S:
            # A longer run goes on while they begin: the hand takes half a second to the tooth.
            for process, shows in ((self.window, "window-shows"), (self.pictures, "painter-shows")):
                self.wait_until_shown(process, shows)
        pace = []
        if options.virtual:
            pace = ["--lockstep", "--rate", rate_hz]
        elif options.port == "socket" and rate_hz > 2000:
            pace = ["--packet-cycles", 8000 // rate_hz]  # else it checks for the host 2000 times a second
        self.emulator = processes.start("emulator", [
            "--personality", options.device, *self.offer, *hand, *self.identified("identified", told), "--unit-mm", told.get("hand_unit_mm", ""), *pace,
            "--report", os.path.join(self.results, "emulator.json")], out="emulator.log", log="emulator.log")
        while not self.is_met() and self.emulator.poll() is None:
            time.sleep(0.02)
        if not self.is_met():  # it refused something, or a very short run is over
            code = processes.conclude("emulator", self.emulator, 0)
            if code:
                sys.exit(code)
            self.emulator = None
        elif options.port == "arm":
            self.start_arm()
        if options.second and self.emulator is not None:
            self.second = processes.start("emulator", [
                "--personality", options.second, "--front", "socket", "--socket", processes.path("device-2"),
                *self.script_of("second_hand_script", told), *self.identified("second_identified", told), "--unit-mm", told.get("second_hand_unit_mm", ""), *pace,
                "--report", os.path.join(self.results, "emulator-2.json")], out="emulator-2.log", log="emulator-2.log")

    def service(self):
        return f"{self.meet[0]}:{self.meet[1]}"

    def start_arm(self):
        """The adapter to the vendor's service, or to its library. kerf's stand-in for that finds the emulator by KERF_STAND_IN."""
        common = ["--device", self.options.device, "--name", self.name, "--report", os.path.join(self.results, "arm.json")]
        if self.options.device not in demo_options.STAND_INS:
            self.kerf_arm = self.processes.start("arm", [*common, "--service", self.service()], out="arm.log", log="arm.log")
            return
        settings = f"socket:{self.meet},device={self.options.device},hand=pushed,priority=81"  # as the emulator
        os.environ["KERF_STAND_IN"] = settings
        self.kerf_arm = self.processes.start("arm", [*common, "--library", os.path.abspath(self.options.library)], out="arm.log", log="arm.log")

    def is_met(self):
        if isinstance(self.meet, str):
            return os.path.exists(self.meet)
        with socket.socket() as asking:
            return asking.connect_ex(self.meet) == 0

    def hand(self, told):
        if self.options.mouse:
            pedal = ["--wireless-button"] if self.options.device == "woodenhaptics" else []  # its arm has no button
            return ["--hand-socket", self.processes.path("hand"), *pedal]
        if self.options.hand:
            return ["--hand", self.options.hand]
        return self.script_of("hand_script", told)

    @staticmethod
    def identified(name, told):
        """What the emulator has to be like, if the scene says."""
        return ["--identified", told[name]] if told.get(name) else []

    def script_of(self, name, told):
        script = told.get(name, "")
        if script and not os.path.isfile(script):
            raise Refusal(f"--scene {self.scene}: its hand.script, {script}, is no file; copy the script there, or give --hand FILE")
        return ["--hand", script or os.path.join(self.root, "scenes", "hands", "cut_cavity.toml")]

    def start_pictures(self, rate_hz):
        """A window, and pictures without one; one of them makes the video."""
        options, processes = self.options, self.processes
        common = ["--name", self.name, *options.look]
        record = ["--record", options.record] if options.record else []
        if not options.headless:
            led = ["--hand-socket", processes.path("hand")] if options.mouse else []
            led += ["--ends-after", options.seconds] if options.bound_is_told else []
            # Where the path that a line shows leads to at once, and after the run.
            keys_out = ["--out", self.options.out] if self.out else []  # else the window's keys write to the current folder
            self.window = processes.start("visualizer", [
                *common, *(["--size", options.size] if options.size else []), *options.screen, *record, *led, *keys_out, "--attached", processes.path("window-shows"),
                "--choice", processes.path("choice"), "--open-in", os.path.dirname(self.scene) or "."],
                out="window.log", log="window.log")
            record = []
        if options.headless or self.out:
            every = int(float(options.seconds) * rate_hz / FRAMES) or 1
            self.pictures = processes.start("visualizer", [
                *common[:2], "--headless", "--size", options.size or PICTURE_SIZE, "--frames", FRAMES, *common[2:], *record,
                *(["--sheet", options.sheet] if options.sheet else []), *self.lead, "--every-ticks", every, "--out", self.results,
                "--attached", processes.path("painter-shows"), "--report", os.path.join(self.results, "visualizer.json")],
                out="visualizer.log", log="visualizer.log")

    def wait_until_shown(self, process, name):
        end = time.monotonic() + PATIENCE_S
        while (process is not None and not os.path.exists(self.processes.path(name)) and process.poll() is None
               and self.controller.poll() is None and time.monotonic() < end):
            time.sleep(0.02)

    def watch(self):
        """Until the controller ends. Pictures that cannot begin end the demo; so does a window that is closed while it is the
        hand, or in which another scene was chosen. What fails later, as on a full disk, is reported in its own line, and the
        rest goes on. Returns the exit code of what ended the demo, and whether anything failed or was cut short."""
        processes, failed, cut = self.processes, 0, False
        end = time.monotonic() + float(self.options.seconds)
        closing_is_told = False
        while self.controller.poll() is None:
            time.sleep(0.1)
            if failed:
                continue
            if self.recorder is not None and self.recorder.poll() is not None:
                worst = processes.conclude("recorder", self.recorder, 0)
                self.recorder = None
                if self.is_taken():
                    failed = worst
                else:
                    cut = bool(worst) or cut
            if self.pictures is not None and self.pictures.poll() is not None:
                worst = processes.conclude("visualizer", self.pictures, 0)
                self.pictures = None
                if self.is_taken() or not os.path.exists(processes.path("painter-shows")):
                    failed = worst or failed
                else:
                    cut = bool(worst) or cut
            leads = self.options.mouse or os.path.exists(processes.path("choice"))
            if self.window is not None and not (leads or closing_is_told) and self.window.poll() == 0:
                closing_is_told = True
                if end - time.monotonic() > PATIENCE_S:
                    say(f"kerf: demo: the window is closed; the hand works on to the end of its {self.options.seconds} s: Ctrl-C ends it")
            if self.window is not None and leads and self.window.poll() is not None:
                failed = processes.conclude("window", self.window, 0) or failed
                if failed and os.path.exists(processes.path("window-shows")):  # its screen is gone: keep the results so far
                    complain("kerf: demo: the hand went with its window; this run ends here")
                    failed, cut = 0, True
                self.window = None
                terminate(self.controller)
            if failed:
                if self.out:
                    self.out.empty_results()
                terminate(self.controller)
        return failed, cut

    def finish(self, failed, cut):
        options, processes = self.options, self.processes
        code = exit_code(self.controller)
        if failed:
            return failed
        # It has reported why it could not begin, and the others only wait for it.
        if code == 2 and self.code_of_signal is None and not self.has_log():
            if self.kerf_arm is not None and self.kerf_arm.poll() is not None:
                processes.conclude("arm", self.kerf_arm, 0)
            if self.emulator is not None and self.emulator.poll() is not None:
                processes.conclude("emulator", self.emulator, 0)
            return 2
        self.print_summary()
        terminate(self.window)
        terminate(self.kerf_arm)  # before its emulator ends, which would be a lost device to it
        for name, process, seconds in (("window", self.window, 10), ("recorder", self.recorder, 10),
                                       ("visualizer", self.pictures, 60), ("arm", self.kerf_arm, 5), ("emulator", self.emulator, 5),
                                       ("emulator-2", self.second, 5)):
            if process is not None:
                worst = processes.conclude(name, process, seconds)
                failed = (1 if worst and name == "window" else worst) or failed
        terminate(self.bridge)
        if self.bridge is not None:
            failed = processes.conclude("bridge", self.bridge, 5) or failed
        if self.code_of_signal is None and crashed("controller", code):
            code = 1
        code = code or failed or int(cut)
        self.finishing = True
        code = self.keep(code)
        choice = pathlib.Path(processes.path("choice"))
        if choice.exists() and self.code_of_signal is None and code == 0:
            self.next_demo(choice.read_text().rstrip("\n"))
        return code if self.code_of_signal is None else self.code_of_signal

    def is_taken(self):
        """Another program took the folder of the results away."""
        return bool(self.out) and not os.path.isdir(self.results)

    def has_log(self):
        return os.path.exists(os.path.join(self.results, "log", "ticks.npy"))

    def print_summary(self):
        try:
            say(pathlib.Path(self.processes.path("summary")).read_text(errors="replace").rstrip("\n"))
        except OSError:
            pass

    def keep(self, code):
        """Draws the plot and publishes the results, as many as there are. Returns the exit code."""
        options, processes = self.options, self.processes
        if self.out and (self.has_log() or code != 2 and os.path.exists(os.path.join(self.results, "report.json"))):
            failed = False
            if self.can_plot():
                plot = processes.start("record", ["plot", os.path.join(self.results, "log"), "--out", os.path.join(self.results, "forces.svg")],
                                       out="record.log", log="record.log")
                failed = processes.conclude("record", plot, 30)
            if failed or code:
                code = code if code > 2 else 1
            line, in_place = self.out.publish()
            if in_place:
                say(line)
            else:
                complain(line)
                code = 1
        elif not self.out and options.headless and code == 0:
            say(f"kept {' '.join(filter(None, (options.sheet, options.record)))} alone: --out DIR keeps pictures, plot, report and log")
        return code

    @staticmethod
    def can_plot():
        """An installed kerf does without what draws plots (cmake/package.cmake)."""
        if importlib.util.find_spec("matplotlib"):
            return True
        complain("kerf: demo: forces.svg is not drawn: no matplotlib; apt-get install python3-matplotlib")
        return False

    def next_demo(self, path):
        """Another demo replaces this one, with the scene or volume that the window chose."""
        self.processes.end()
        if self.out:
            self.out.close()
        say(f"kerf: demo: {path}")
        for number in [signal.SIGINT, *END]:
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, signal.SIG_DFL)
        what = "--scene" if path.endswith(".toml") else "--volume"
        os.execv(self.kerf, [self.kerf, "demo", what, path, *self.options.again])


def main():
    programs, kerf, *words = sys.argv[1:]
    try:
        return Demo(programs, kerf, demo_options.parse(words)).run()
    except Refusal as refusal:
        text = re.sub(r"[\x00-\x1f\x7f]", "?", str(refusal))
        installed = not os.path.exists(os.path.join(os.path.dirname(kerf), "CMakeLists.txt"))
        complain("kerf: demo: " + (text.replace("./kerf ", "kerf ") if installed else text))
        return 2
    except KeyboardInterrupt:  # while it builds
        return 130


sys.exit(main())
