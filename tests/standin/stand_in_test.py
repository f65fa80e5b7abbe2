# SPDX-License-Identifier: Apache-2.0
"""`./kerf stand-in` with two programs by ctypes: what they measure against the emulator's truth, each kind of misuse, the
switches for what no document says. In lock-step, so nothing depends on this machine's speed.

    stand_in_test.py ROOT PROGRAMS LIBRARIES"""
import ctypes
import json
import math
import os
import subprocess
import sys
import time
import unittest
import xml.etree.ElementTree

from stand_in_case import COMMAND, HERE, LIBRARIES, ROOT, Case

HD_NAMES = """InitDevice MakeCurrentDevice DisableDevice BeginFrame EndFrame GetCurrentDevice Enable Disable IsEnabled
GetBooleanv GetIntegerv GetFloatv GetDoublev GetLongv SetBooleanv SetIntegerv SetFloatv SetDoublev SetLongv GetString
GetErrorString GetError CheckCalibration UpdateCalibration CheckCalibrationStyle UpdateCalibrationMessage ScaleGimbalAngles
DeploymentLicense StartScheduler StopScheduler SetSchedulerRate ScheduleSynchronous ScheduleAsynchronous Unschedule
WaitForCompletion GetSchedulerTimeStamp""".split()
SECONDS = 60
# Circles for all of the time, then to one place, where it stays.
HAND = f"""
unit_mm = 1.0
start_mm = [0, 5, 0]
[[step]]
circle_mm = 25.0
turns = {SECONDS // 3}
seconds = {SECONDS - 8}
button = 1
[[step]]
move_mm = [12, 7, -3]
seconds = 1.5
[[step]]
hold = 1
"""
# One that lets the device lead it.
SOFT_HAND = """
unit_mm = 1.0
start_mm = [0, 5, 0]
[hand]
stiffness_n_per_mm = 0.001
[[step]]
hold = 60
"""


class ClosedLoop(Case):
    """A minute of a spring, against what the emulator's mechanics did."""

    def compare(self, client, options, count_mm, position_mm):
        hand = ["--hand", self.file("hand.toml", HAND)]
        first = self.run_client(client, "spring", SECONDS * 1000, [*options, *hand])
        code, report, program, said = first
        self.assertEqual((code, report["misuse"]), (0, []), said)
        force = report["force"]
        self.assertGreater(program["peak_n"], 1)
        self.close(force["peak_n"], program["peak_n"])
        self.close(force["given_peak_n"], program["peak_n"])
        self.close(force["rms_n"], program["rms_n"])
        self.close(force["given_rms_n"], program["rms_n"])
        self.assertGreater(program["work_mj"], 20)  # the spring lifts the hand from where it is parked
        self.close(report["energy"]["given_mj"], program["work_mj"])
        for seen, truth in zip(position_mm(program), report["final_tip_mm"]):
            self.assertLessEqual(abs(seen - truth), count_mm)
        self.assertGreater(report["seconds"], SECONDS)
        # The same once more, to the bit.
        again = self.run_client(client, "spring", SECONDS * 1000, [*options, *hand])
        self.assertEqual(again[1]["report_hash"], report["report_hash"])
        self.assertEqual(again[2], program)
        return program

    def test_hd(self):
        program = self.compare("hd_client.py", [], 0.055, lambda program: program["last_mm"])
        self.assertEqual(program["errors"], [])
        self.assertIn("kerf", program["vendor"])
        self.assertEqual(program["buttons"], 1)
        self.assertEqual([round(x) for x in program["first_mm"]], [0, -110, -35])

    def test_dhd(self):
        def in_mm(program):
            x, y, z = (1000 * m for m in program["last_m"])
            return y, z, x

        program = self.compare("dhd_client.py", ["--device", "omega"], 0.010, in_mm)
        self.assertEqual((program["name"], program["type"]), ("omega.3 (kerf stand-in)", 33))
        self.assertEqual(program["first_m"], [0, 0, 0.05])  # parked above
        self.assertEqual(program["buttons"], 0b11)  # parked, and the hand's first button

    def test_drd_moves_a_hand_that_lets_it(self):
        hand = ["--device", "omega", "--hand", self.file("hand.toml", SOFT_HAND)]
        code, report, program, said = self.run_client("dhd_client.py", "move", 1, hand)
        self.assertEqual((code, report["misuse"]), (0, []), said)
        self.assertLess(max(program["off_m"]), 0.0015)


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


class Unknowns(Case):
    """What no document says about a vendor's device, both ways."""

    def test_a_force_after_a_kill_is_held_or_dropped(self):
        given = {}
        for way in ("hold", "drop"):
            _, report, _, _ = self.run_client("hd_client.py", "killed", 50, ["--on-silence", way])  # still in the inkwell
            given[way] = report["force"]["given_at_end_n"]
        self.close(given["hold"], 1.5)
        self.assertLess(given["drop"], 0.001)

    def test_a_tick_without_a_frame_holds_or_drops(self):
        rms = {}
        for way in ("hold", "drop"):
            _, report, _, _ = self.run_client("hd_client.py", "open_frame", 50, ["--switch", f"missed={way}"])
            rms[way] = report["force"]["given_rms_n"]
            self.close(report["force"]["rms_n"], 1.5, 0.002)  # of the frames that were ended
        self.close(rms["drop"], rms["hold"] * math.sqrt(45 / 50), 0.002)  # one tick of ten has no frame

    def test_an_excess_is_clamped_or_cut(self):
        pull = self.file("pull.py", """
import ctypes
dhd = ctypes.CDLL("libdhd.so")
dhd.dhdSetForce.argtypes = [ctypes.c_double] * 3 + [ctypes.c_byte]
dhd.dhdOpen()
assert dhd.dhdSetForce(100, 0, 0, -1) == 2
for _ in range(50): dhd.dhdSetForce(100, 0, 0, -1)
dhd.dhdStop(-1); dhd.dhdClose(-1)
""")
        for way, peak in (("clamp", 12), ("cut", 0)):
            options = ["--device", "omega", "--switch", f"excess={way}"]
            _, report, said = self.run_command("/usr/bin/python3", "-B", pull, options=options)
            self.assertEqual(report["misuse"], [], said)
            self.assertAlmostEqual(report["force"]["given_peak_n"], peak)

    def test_the_watchdog_ends_the_force(self):
        code, report, program, said = self.run_client("dhd_client.py", "watchdog", 1, ["--device", "omega"])
        self.assertEqual((code, [one["what"] for one in report["notes"]]), (0, ["watchdog"]), said)
        self.assertEqual((program["status"][5], program["status"][6], program["status"][14]), (0, 1, 3))  # force, brake, cause

    def test_a_button_of_no_gripper_is_accepted_or_refused(self):
        program = self.file("button.py", """
import ctypes, sys
dhd = ctypes.CDLL("libdrd.so.3")
dhd.dhdOpen()
told = [dhd.dhdEmulateButton(ctypes.c_ubyte(on), ctypes.c_byte(-1)) for on in (1, 0)]
told.append(dhd.dhdErrorGetLast() if told[0] else dhd.dhdGetButtonMask(ctypes.c_byte(-1)))  # parked, and no other button
dhd.dhdClose(ctypes.c_byte(-1))
sys.exit(told != eval(sys.argv[1]))
""")
        for way, told in (("accept", [0, 0, 1]), ("refuse", [-1, -1, 6])):
            options = ["--device", "omega", "--switch", f"emulate-button={way}"]
            code, _, said = self.run_command("/usr/bin/python3", "-B", program, str(told), options=options)
            self.assertEqual(code, 0, said)

    def test_a_device_that_goes_is_an_error_of_the_program(self):
        gone = ["--fault", str(ROOT / "hil/faults/gone.toml")]
        code, report, program, said = self.run_client("hd_client.py", "spring", 4000, gone)
        self.assertIn(0x302, program["errors"], said)
        self.assertEqual([one["what"] for one in report["notes"]], ["lost_link"])
        self.assertEqual(code, 0, said)


# Order of callbacks, and when a call returns; run in lock-step, where a tick needs a callback.
SCHEDULER = """
import ctypes
hd = ctypes.CDLL('libHD.so.3.4')
hd.hdScheduleAsynchronous.restype = ctypes.c_ulong
hd.hdGetError.restype = type('Error', (ctypes.Structure,), {'_fields_': [(name, ctypes.c_uint) for name in 'abc']})
kind = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)
calls, ticks = [], []

def callback(name, times, also=lambda: None):
    left = [times]
    def call(_data):
        calls.append(name)
        left[0] -= 1
        also()
        return 1 if left[0] else 0
    return kind(call)

before = hd.hdGetCurrentDevice()
assert hd.hdInitDevice(b'Default PHANToM') == before == 0
assert hd.hdInitDevice(None) == -1 and hd.hdGetError().a == 0x301
hd.hdEnable(0x4000)
at_once = callback('at once', 3)
hd.hdScheduleSynchronous(at_once, None, 7)  # without a scheduler: here, until it is done
assert calls == ['at once'] * 3, calls
assert hd.hdCheckCalibration() == 0x5002  # lost, and the inkwell needs a running scheduler
hd.hdStartScheduler()
del calls[:]
low, high = callback('low', 3), callback('high', 3)
handles = []
both = (low, None, 1), (high, None, 9)
start = callback('start', 1, lambda: handles.extend(hd.hdScheduleAsynchronous(*one) for one in both))
hd.hdScheduleSynchronous(start, None, 0xFFFF)
assert calls[0] == 'start', calls
for handle in handles:
    assert hd.hdWaitForCompletion(ctypes.c_ulong(handle), 1) == 0
flag = ctypes.c_ubyte(7)
hd.hdGetBooleanv(0x2002, ctypes.byref(flag))
assert flag.value == 0, flag.value  # in the inkwell: some ticks from the start; `endless` takes as many as the machine likes
endless = callback('endless', 0)
handle = hd.hdScheduleAsynchronous(endless, None, 5)
assert hd.hdWaitForCompletion(ctypes.c_ulong(handle), 0) == 1
done = callback('done', 1)
hd.hdScheduleSynchronous(done, None, 0)  # of the lowest priority: after all others of its tick
assert calls[-1] == 'done' or calls[-1] == 'endless', calls
hd.hdUnschedule(ctypes.c_ulong(handle))
count = len(calls)
assert hd.hdWaitForCompletion(ctypes.c_ulong(handle), 0) == 0
# A callback that a callback schedules runs at once: low came first there; then by priority.
order = [name for name in calls if name in ('low', 'high')]
assert order == ['low', 'high', 'high', 'low', 'high', 'low'], order
assert hd.hdCheckCalibration() == 0x5000
hd.hdStopScheduler()
assert len(calls) == count
for get, name, error in (hd.hdGetIntegerv, 0x2050, 0x103), (hd.hdGetDoublev, 0x1234, 0x100), (hd.hdGetLongv, 0x2750, 0x102):
    get(name, (ctypes.c_double * 16)())
    assert hd.hdGetError().a == error
hd.hdBeginFrame(1)
hd.hdEndFrame(0)
assert [hd.hdGetError().a for _ in range(3)] == [0x401, 0x104, 0]  # the newest first
hd.hdDisableDevice(0)
assert hd.hdInitDevice(None) == 0  # once more
hd.hdDisableDevice(0)
"""

# Stops and starts while calls wait and callbacks run.
RESTART = """
import ctypes, threading
hd = ctypes.CDLL('libHD.so')
hd.hdScheduleAsynchronous.restype = ctypes.c_ulong
hd.hdGetError.restype = type('Error', (ctypes.Structure,), {'_fields_': [(name, ctypes.c_uint) for name in 'abc']})
kind = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)
hd.hdInitDevice(None)
hd.hdEnable(0x4000)

calls, began = [0], threading.Event()

def endless(_data):
    calls[0] += 1
    began.set()
    return 1

endless = kind(endless)
done = kind(lambda _data: 0)
caller = threading.Thread(target=lambda: hd.hdScheduleSynchronous(endless, None, 9))
hd.hdStartScheduler()
caller.start()
began.wait()
hd.hdStopScheduler()
caller.join()
count = calls[0]
hd.hdStartScheduler()
hd.hdScheduleSynchronous(done, None, 0)  # of the lowest priority: after all others of its tick
assert calls[0] == count, 'called after its caller had returned'

errors, stopped, returned = [], threading.Event(), threading.Event()

def stop(_data):
    hd.hdStopScheduler()
    hd.hdStartScheduler()  # cannot be: this is the last tick
    errors.append(hd.hdGetError().a)
    stopped.set()
    returned.wait(0.5)  # a start by another thread waits for this tick, so it has not returned
    return 0

stop = kind(stop)
hd.hdScheduleAsynchronous(stop, None, 1)
stopped.wait()
hd.hdStartScheduler()
returned.set()
assert errors == [0x102], errors
began.clear()
handle = hd.hdScheduleAsynchronous(endless, None, 1)
assert began.wait(20), 'the scheduler does not run'
hd.hdUnschedule(ctypes.c_ulong(handle))
assert hd.hdGetError().a == 0
hd.hdStopScheduler()
hd.hdDisableDevice(0)
"""


class Scheduler(Case):
    def test_callbacks_run_by_priority_and_calls_return_when_they_should(self):
        code, report, said = self.run_command("/usr/bin/python3", "-B", self.file("scheduler.py", SCHEDULER),
                                              options=["--switch", "calibration=lost"])
        self.assertEqual(report["exit_code"], 0, said)
        self.assertEqual((code, self.misuse(report)), (1, ["bad_handles", "ends_refused"]), said)

    def test_a_stop_ends_the_calls_that_wait_and_a_start_begins_anew(self):
        code, report, said = self.run_command("/usr/bin/python3", "-B", self.file("restart.py", RESTART))
        self.assertEqual((code, report["misuse"]), (0, []), said)


class Names(unittest.TestCase):
    def test_every_name_of_the_interfaces_is_there(self):
        hd = ctypes.CDLL(str(LIBRARIES / "libHD.so"))
        self.assertEqual([name for name in HD_NAMES if not hasattr(hd, "hd" + name)], [])
        self.assertEqual(len(HD_NAMES), 36)
        drd = ctypes.CDLL(str(LIBRARIES / "libdrd.so.3"))
        names = (HERE / "dhd_names.txt").read_text().split()
        self.assertEqual([name for name in names if not hasattr(drd, name)], [])
        self.assertGreater(len(names), 230)

    def test_without_the_environment_there_is_no_device(self):
        words = ("import ctypes; hd = ctypes.CDLL('libHD.so'); hd.hdInitDevice.restype = ctypes.c_uint; "
                 "print(hd.hdInitDevice(None))")
        environment = {name: value for name, value in os.environ.items() if name != "KERF_STAND_IN"}
        done = subprocess.run(["/usr/bin/python3", "-c", words], capture_output=True, text=True, check=False,
                              env={**environment, "LD_LIBRARY_PATH": str(LIBRARIES)})
        self.assertEqual(done.stdout.strip(), str(0xFFFFFFFF))
        self.assertIn("./kerf stand-in -- COMMAND", done.stderr)


class BadInput(Case):
    def test_every_wrong_option_is_one_line(self):
        for options in (["--device", "falcon"], ["--seconds", "x"], ["--rate", "3"], ["--rate", "3000"],
                        ["--on-silence", "kept"], ["--switch", "missed=both"], ["--switch", "x"], ["--switch", "stall=x"],
                        ["--switch", "stall=0"], ["--switch", "stall=60001"], ["--switch", "ramp=11"], ["--switch", "lockstep"],
                        ["--hand", "/nowhere"], ["--report", "/nowhere/x"], ["--what"], ["--hand"]):
            with self.subTest(options=options):
                done = subprocess.run([*COMMAND, *options, "--", "true"], capture_output=True, text=True, check=False)
                self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)

    def test_the_range_of_a_switch_is_that_of_the_libraries(self):
        for switch in ("stall=1", "stall=60000", "ramp=10", "ramp=0"):
            with self.subTest(switch=switch):
                code, report, said = self.run_command("true", options=["--switch", switch])
                self.assertEqual((code, self.misuse(report)), (1, ["not_opened"]), said)
                _, report, _, said = self.run_client("hd_client.py", "spring", 20, ["--switch", switch])
                # A machine that pauses the client for a millisecond is a stall of stall=1, and no fault of the switch.
                may = ["stalls"] if switch == "stall=1" else []
                self.assertLessEqual(set(self.misuse(report)), set(may), said)
                self.assertEqual(report["exit_code"], 0, said)

    def test_a_comma_in_tmpdir_is_one_line(self):
        folder = self.folder / "a,b"
        folder.mkdir()
        done = subprocess.run([*COMMAND, "--", "true"], capture_output=True, text=True, check=False,
                              env={**os.environ, "TMPDIR": str(folder)})
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
        self.assertIn("comma", done.stderr)

    def test_a_hand_that_the_emulator_refuses_is_its_line(self):
        code, _, said = self.run_command("true", options=["--hand", self.file("bad.toml", "what = 1\n")])
        self.assertEqual((code, said.count("\n")), (2, 1), said)
        self.assertIn("bad.toml", said)


unittest.main(argv=sys.argv[:1], verbosity=1)
