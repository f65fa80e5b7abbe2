# SPDX-License-Identifier: Apache-2.0
"""`./kerf stand-in` with two programs by ctypes: what they measure against the emulator's truth, the switches for what no
document says, names and options. In lock-step, so nothing depends on this machine's speed.

    stand_in_test.py ROOT PROGRAMS LIBRARIES"""
import ctypes
import math
import os
import subprocess
import sys
import unittest

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
