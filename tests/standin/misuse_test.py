# SPDX-License-Identifier: Apache-2.0
"""What `./kerf stand-in` finds wrong in a program, each kind of it; how a program ends, and what it commanded until then.

    misuse_test.py ROOT PROGRAMS LIBRARIES"""
import json
import math
import subprocess
import sys
import time
import unittest
import xml.etree.ElementTree

from stand_in_case import COMMAND, Case


class Misuse(Case):
    def expect(self, client, what, found, options=(), code=1, count=400, lockstep=True):
        with self.subTest(client=client, what=what, options=options):
            exit_code, report, program, said = self.run_client(client, what, count, options, lockstep)
            self.assertEqual(self.misuse(report), sorted(found), said)
            self.assertEqual(exit_code, code, said)
            failed = {case.get("name") for case in xml.etree.ElementTree.parse(self.folder / "report.xml").iter("testcase")
                      if case.find("failure") is not None}
            self.assertEqual(failed, set(found) | ({"command"} if report["exit_code"] else set()))
            return report, program

    def test_of_hd(self):
        _, program = self.expect("hd_client.py", "open_frame", ["frames_not_ended", "not_cleared"])
        self.assertEqual(set(program["errors"]), set())
        for what, found, errors in (("twice", ["begins_refused"], {0x400}), ("end_twice", ["ends_refused"], {0x401}),
                                    ("outside", ["set_outside_frame"], {0x402}), ("nan", ["not_finite"], {0x101}),
                                    ("bad_handle", ["bad_handles", "bad_schedules"], {0x104, 0x101}),
                                    ("not_cleared", ["not_cleared"], set()),
                                    ("no_close", ["force_at_end", "left_open", "not_cleared"], set())):
            _, program = self.expect("hd_client.py", what, found)
            self.assertEqual(set(program["errors"]), errors, what)
        self.expect("hd_client.py", "killed", ["force_at_end", "left_open"], code=137)
        self.expect("hd_client.py", "stall", ["stalls"], ["--switch", "stall=50"])

    def test_a_force_that_was_given_is_not_cleared_whoever_gave_it(self):
        program = self.file("frames.py", """
import ctypes, sys
hd = ctypes.CDLL("libHD.so")
device = hd.hdInitDevice(None)
hd.hdEnable(0x4000)
def frame(force):
    hd.hdBeginFrame(device)
    hd.hdSetDoublev(0x2700, (ctypes.c_double * 3)(force, 0, 0))
    hd.hdEndFrame(device)
exec(sys.argv[1])
hd.hdDisableDevice(device)
""")
        start, stop = "hd.hdStartScheduler()", "hd.hdStopScheduler()"
        for what, found in (("frame(1)", ["not_cleared"]), ("frame(1); frame(0)", []),
                            ("frame(1); hd.hdDisable(0x4000)", []), (f"{start}; {stop}", []),
                            (f"{start}; frame(1); {stop}", []),  # no tick came, so no force left
                            (f"frame(1); {start}; {stop}", ["not_cleared"])):
            with self.subTest(what=what):
                code, report, said = self.run_command("/usr/bin/python3", "-B", program, what)
                self.assertEqual((code, self.misuse(report)), (len(found), found), said)
                if found:
                    self.assertEqual([one["count"] for one in report["misuse"]], [1])

    def test_of_dhd(self):
        omega = ["--device", "omega"]
        for what, found in (("nan", "not_finite"), ("wrong_id", "bad_handles"), ("not_cleared", "not_cleared")):
            self.expect("dhd_client.py", what, [found], omega)
        self.expect("dhd_client.py", "killed", ["force_at_end", "left_open"], omega, code=137)
        # a pause is one of the clock
        self.expect("dhd_client.py", "pause", ["stalls"], [*omega, "--switch", "stall=50"], lockstep=False)

    def test_the_exit_code_is_the_commands(self):
        for words, code in ((["false"], 1), (["sh", "-c", "exit 7"], 7), (["true"], 1)):
            got, report, said = self.run_command(*words)
            self.assertEqual((got, self.misuse(report)), (code, ["not_opened"]), said)

    def test_a_program_behind_a_shell_is_ended_with_it(self):
        program = self.file("behind.py", """
import ctypes, os, signal, sys, time
def end(number, _frame):
    with open(sys.argv[1] + ".signal", "w") as file: file.write(str(number))
    raise KeyboardInterrupt
for number in signal.SIGINT, signal.SIGTERM: signal.signal(number, end)
hd = ctypes.CDLL("libHD.so")
hd.hdInitDevice(None)
callback = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)(lambda _data: 1)
hd.hdStartScheduler()
hd.hdScheduleAsynchronous(callback, None, 1)
try:
    os.mkdir(sys.argv[1])
    time.sleep(60)
finally:
    time.sleep(0.5)  # longer than its shell
    hd.hdStopScheduler()
    hd.hdDisableDevice(0)
    os.rmdir(sys.argv[1])
""")
        runs, by, report = self.folder / "runs", self.folder / "runs.signal", self.folder / "report.json"
        command = ["sh", "-c", '"$@"; true', "sh", "/usr/bin/python3", "-B", program, str(runs)]
        code, found, said = self.run_command(*command, options=["--rate", "100", "--seconds", "20"])  # 2000 ticks
        self.assertEqual((code, self.misuse(found), runs.exists(), by.read_text()), (0, [], False, "2"), said)
        running = subprocess.Popen([*COMMAND, "--report", report, "--", *command], stderr=subprocess.DEVNULL)
        while not runs.exists() and running.poll() is None:
            time.sleep(0.02)
        running.terminate()
        self.assertEqual(running.wait(60), 143)
        found = set(self.misuse(json.loads(report.read_text())))
        self.assertEqual((found - {"stalls"}, runs.exists(), by.read_text()), (set(), False, "15"))  # the machine may be busy

    def test_frames_after_the_end_of_the_devices_time_are_no_commands(self):
        program = self.file("longer.py", """
import ctypes, signal
signal.signal(signal.SIGINT, signal.SIG_IGN)
hd = ctypes.CDLL("libHD.so")
hd.hdScheduleAsynchronous.restype = ctypes.c_ulong
hd.hdInitDevice(None)
left = [700]
def tick(_data):
    hd.hdBeginFrame(0)
    hd.hdEndFrame(0)
    left[0] -= 1
    return 1 if left[0] else 0
callback = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)(tick)
hd.hdStartScheduler()
hd.hdWaitForCompletion(ctypes.c_ulong(hd.hdScheduleAsynchronous(callback, None, 1)), 1)
hd.hdStopScheduler()
hd.hdDisableDevice(0)
""")
        _, report, said = self.run_command("/usr/bin/python3", "-B", program, options=["--seconds", "0.5"])
        self.assertEqual(report["deadlines"]["ticks"], 700, said)
        self.assertLessEqual(report["force"]["commands"], 501, said)

    def test_a_program_for_another_device_is_told(self):
        code, report, _, said = self.run_client("hd_client.py", "spring", 10, ["--device", "omega"])
        self.assertEqual((code, self.misuse(report)), (1, ["not_opened"]))
        self.assertIn("take ./kerf stand-in --device touch", said)


# Forces of a small program, in words of its own for HD and dhd: what it commands, and what the device gives, are two figures.
FRAMES = """
import ctypes, sys
hd = ctypes.CDLL("libHD.so")
device = hd.hdInitDevice(None)
def frames(force, count=40):
    for _ in range(count):
        hd.hdBeginFrame(device)
        hd.hdSetDoublev(0x2700, (ctypes.c_double * 3)(force, 0, 0))
        hd.hdEndFrame(device)
exec(sys.argv[1])
frames(0, 1)
hd.hdDisableDevice(device)
"""
FORCES = """
import ctypes, sys
dhd = ctypes.CDLL("libdrd.so.3")
dhd.dhdSetForce.argtypes = [ctypes.c_double] * 3 + [ctypes.c_byte]
dhd.dhdSleep.argtypes = [ctypes.c_double]
dhd.dhdOpen()
def forces(force, count=40):
    for _ in range(count): dhd.dhdSetForce(force, 0, 0, -1)
exec(sys.argv[1])
dhd.dhdStop(-1)
dhd.dhdClose(-1)
"""


class Forces(Case):
    def expect(self, text, what, commanded, given, misuse=(), notes=(), options=()):
        """`commanded`: number of forces, peak, RMS. `misuse`, `notes`: name to count."""
        with self.subTest(what=what, options=options):
            code, report, said = self.run_command("/usr/bin/python3", "-B", self.file("program.py", text), what, options=options)
            force, misuse, notes = report["force"], dict(misuse), dict(notes)
            self.assertEqual(force["commands"], commanded[0], said)
            self.close(force["peak_n"], commanded[1], 1e-6)
            self.close(force["rms_n"], commanded[2], 1e-6)
            self.assertLess(abs(force["given_peak_n"] - given), 0.002, said)
            self.assertEqual({one["what"]: one["count"] for one in report["misuse"]}, misuse, said)
            self.assertEqual({one["what"]: one["count"] for one in report["notes"]}, {**misuse, **notes}, said)
            self.assertEqual(code, 1 if misuse else 0, said)
            failed = {case.get("name"): case.find("failure").get("message") for case in
                      xml.etree.ElementTree.parse(self.folder / "report.xml").iter("testcase") if case.find("failure") is not None}
            self.assertEqual(failed, {name: f"{count} x forces while the output was off" for name, count in misuse.items()})
            for count in misuse.values():
                self.assertEqual(said.count(f"{count} x forces while the output was off"), 1, said)

    def test_what_hd_is_commanded_and_what_it_gives_are_two_figures(self):
        def rms(newtons):  # 40 frames, and one of no force before the end
            return newtons * math.sqrt(40 / 41)
        enable, disable = "hd.hdEnable(0x4000)", "hd.hdDisable(0x4000)"
        self.expect(FRAMES, "frames(1)", (41, 1, rms(1)), 0, {"output_off": 40})
        self.expect(FRAMES, f"{enable}; frames(1)", (41, 1, rms(1)), 1)
        # Every force beyond 4 N is also a step of more than 4 N, from none: 3.3 N after the clamp is not.
        self.expect(FRAMES, f"{enable}; frames(5)", (41, 5, rms(5)), 3.3, {}, {"excess": 40})
        self.expect(FRAMES, f"{enable}; frames(5)", (41, 5, rms(5)), 0, {}, {"excess": 40}, ["--switch", "excess=cut"])
        self.expect(FRAMES, f"{enable}; frames(1, 20); {disable}; frames(1, 20)", (41, 1, rms(1)), 1, {"output_off": 20})
        self.expect(FRAMES, f"{disable}; frames(0)", (41, 0, 0), 0)

    def test_what_dhd_is_commanded_and_what_it_gives_are_two_figures(self):
        omega = ["--device", "omega"]
        on, stop, ignore = "dhd.dhdEnableForce(1, -1)", "dhd.dhdStop(-1)", ["--switch", "before-enable=ignore"]
        self.expect(FORCES, f"{on}; forces(20)", (40, 20, 20), 12, {}, {"excess": 40}, omega)
        self.expect(FORCES, f"{on}; forces(2)", (40, 2, 2), 2, {}, {}, omega)
        self.expect(FORCES, f"{on}; forces(2); {stop}; forces(2)", (80, 2, 2), 2, {"output_off": 40}, {}, omega)
        self.expect(FORCES, f"{on}; dhd.dhdEnableForce(0, -1); forces(2)", (40, 2, 2), 0, {"output_off": 40}, {}, omega)
        # through the regulator of drd: a force of the program's own
        drd = "dhd.drdStart(-1); dhd.drdRegulatePos(ctypes.c_bool(False), -1); force = dhd.drdSetForceAndTorqueAndGripperForce"
        drd += "; force.argtypes = [ctypes.c_double] * 7 + [ctypes.c_byte]; force(20, 0, 0, 0, 0, 0, 0, -1)"
        self.expect(FORCES, f"{drd}; [dhd.drdWaitForTick(-1) for _ in range(40)]; dhd.drdStop(ctypes.c_bool(True), -1)",
                    (40, 20, 20), 12, {}, {"excess": 40}, omega)
        # dhdEnableForce forgotten: no document says whether the force is given
        self.expect(FORCES, "forces(2)", (40, 2, 2), 0, {"output_off": 40}, {}, omega + ignore)
        self.expect(FORCES, "forces(2)", (40, 2, 2), 2, {}, {"before_enable": 40}, omega)
        self.expect(FORCES, "forces(0)", (40, 0, 0), 0, {}, {}, omega + ignore)
        # a limit of the program's own, and a device that stops by itself
        limit = "dhd.dhdSetMaxForce.argtypes = [ctypes.c_double, ctypes.c_byte]; dhd.dhdSetMaxForce(1.5, -1)"
        self.expect(FORCES, f"{on}; {limit}; forces(5)", (40, 5, 5), 1.5, {}, {}, omega)
        trip = "dhd.dhdEnableExpertMode(); dhd.dhdSetWatchdog(ctypes.c_ubyte(160), -1); forces(1); dhd.dhdSleep(0.2)"
        self.expect(FORCES, f"{on}; {trip}; forces(1)", (80, 1, 1), 1, {}, {"watchdog": 1, "after_trip": 40}, omega)

    def test_a_sum_that_no_number_holds_is_none_in_json(self):
        for name, text, what, options in (("HD", FRAMES, "hd.hdEnable(0x4000); frames(1e200)", []),
                                          ("dhd", FORCES, "forces(1e200)", ["--device", "omega"])):
            with self.subTest(name=name):
                _, report, said = self.run_command("/usr/bin/python3", "-B", self.file("program.py", text), what, options=options)
                self.assertEqual((report["force"]["peak_n"], report["force"]["rms_n"]), (1e200, None), said)
                self.assertNotRegex((self.folder / "report.json").read_text(), "Infinity|NaN")
                self.assertIn("peak 1e+200 N, RMS unknown", said)


unittest.main(argv=sys.argv[:1], verbosity=1)
