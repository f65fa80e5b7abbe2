# SPDX-License-Identifier: Apache-2.0
"""`./kerf stand-in` with several devices: which one a call is for, what each of them did, how they are named. In lock-step.

    devices_test.py ROOT PROGRAMS LIBRARIES"""
import sys
import unittest
import xml.etree.ElementTree

from devices_case import DHD, HD, PYTHON, Devices
from stand_in_case import ROOT, Case

TOUCHES = ["--device", "touch", "--vendor-name", "Left", "--device", "touch", "--vendor-name", "Right"]
# Two hands in one callback: nested frames, each with its own force.
NESTED = HD + """
assert hd.hdInitDevice(b"Middle") == NONE
expect((0x300, NONE))
left, right = hd.hdInitDevice(b"Left"), hd.hdInitDevice(b"Right")
assert (left, right, hd.hdGetCurrentDevice()) == (0, 1, right)
assert hd.hdInitDevice(b"Right") == hd.hdInitDevice(None) == NONE
expect((0x301, NONE), (0x301, NONE))
assert hd.hdGetString(0x2504) == b"KERF1"
hd.hdMakeCurrentDevice(7)
expect((0x104, 7))
for device in left, right:
    hd.hdMakeCurrentDevice(device)
    assert hd.hdGetCurrentDevice() == device
    hd.hdEnable(0x4000)
assert hd.hdIsEnabled(0x4000)
hd.hdDisable(0x4001)
hd.hdMakeCurrentDevice(left)
assert hd.hdGetString(0x2504) == b"KERF0" and hd.hdIsEnabled(0x4001)
seen = {}

def frames():
    hd.hdBeginFrame(left)
    hd.hdBeginFrame(right)
    assert hd.hdGetCurrentDevice() == right
    hd.hdSetDoublev(0x2700, Vector(0, 0.5, 0))
    seen["right"] = position()
    hd.hdMakeCurrentDevice(left)
    hd.hdSetDoublev(0x2700, Vector(0.25, 0, 0))
    seen["left"] = position()
    hd.hdEndFrame(left)
    hd.hdEndFrame(right)
    assert hd.hdGetCurrentDevice() == left  # an end changes nothing

hd.hdStartScheduler()
ticks(2500, frames)
def clear():
    for device in left, right:
        hd.hdBeginFrame(device)
        hd.hdEndFrame(device)
ticks(1, clear)
hd.hdStopScheduler()
errors = set(iter(error, (0, 0)))
hd.hdMakeCurrentDevice(left)
hd.hdDisableDevice(left)
assert hd.hdGetCurrentDevice() == NONE  # of the two, the current one is closed
hd.hdDisable(0x4000)
expect((0x104, NONE))
assert hd.hdInitDevice(None) == left  # once more, under the same handle
hd.hdDisableDevice(left)
hd.hdDisableDevice(right)
assert hd.hdGetCurrentDevice() == 0  # as before the first
json.dump({**seen, "errors": sorted(errors)}, open(sys.argv[1], "w"))
"""
ONE_FRAME = HD + """
left, right = hd.hdInitDevice(b"Left"), hd.hdInitDevice(b"Right")
def frames():
    for device in left, right, right:
        hd.hdBeginFrame(device)
        hd.hdEndFrame(device)
    hd.hdSetDoublev(0x2700, Vector(1, 0, 0))
hd.hdStartScheduler()
ticks(1, frames)
hd.hdStopScheduler()
expect((0x402, right), (0x401, right), (0x400, right))
hd.hdDisableDevice(left)
hd.hdDisableDevice(right)
"""
HOLD = """
unit_mm = 1.0
start_mm = {place}
[[step]]
hold = 60
"""
# Who gets a device: by order, by number, by serial number, by type; and what -1 stands for.
OPENINGS = DHD + """
def counts():
    return dhd.dhdGetDeviceCount(), dhd.dhdGetAvailableCount()
ANY = ctypes.c_byte(-1)
assert counts() == (2, 2)
assert dhd.dhdGetDeviceID() == -1
assert (dhd.dhdOpen(), dhd.dhdGetDeviceID(), counts()) == (0, 0, (2, 1))
assert (dhd.dhdOpen(), dhd.dhdGetDeviceID(), counts()) == (1, 1, (2, 0))
assert (dhd.dhdOpen(), dhd.dhdErrorGetLast()) == (-1, 20)
assert (dhd.drdOpen(), dhd.dhdErrorGetLast()) == (-1, 20)
assert (dhd.dhdOpenType(33), dhd.dhdOpenType(63), dhd.dhdErrorGetLast()) == (-1, -1, 5)
assert dhd.dhdGetDeviceID() == 1  # what fails changes nothing
serial = ctypes.c_ushort()
for device, number in (0, 1), (1, 2), (-1, 2):
    assert dhd.dhdGetSerialNumber(ctypes.byref(serial), ctypes.c_byte(device)) == 0 and serial.value == number
assert (dhd.dhdOpenID(0), dhd.drdGetDeviceID()) == (0, 0)  # open: its ID
assert (dhd.dhdOpenID(2), dhd.dhdErrorGetLast()) == (-1, 15)
assert (dhd.dhdOpenSerial(2), dhd.dhdGetDeviceID(), dhd.dhdOpenSerial(3), dhd.dhdErrorGetLast()) == (1, 1, -1, 5)
assert (dhd.dhdSetDevice(ctypes.c_byte(0)), dhd.dhdGetDeviceID(), dhd.drdSetDevice(ctypes.c_byte(5))) == (0, 0, -1)
for _ in range(400):
    assert dhd.dhdSetForce(2, 0, 0, -1) == 0  # of 0
for _ in range(100):
    assert dhd.dhdSetForce(0, 3, 0, 1) == 0
seen = [position(device) for device in range(2)]
before = dhd.dhdGetTime()
dhd.dhdSleep(0.25)
assert dhd.dhdClose(ANY) == 0 and dhd.dhdGetDeviceID() == 1  # the one that was opened before it
assert (dhd.dhdClose(ctypes.c_byte(0)), counts()) == (-1, (2, 1))
assert (dhd.dhdOpen(), dhd.dhdGetDeviceID()) == (0, 0)
for device in range(2):
    dhd.dhdStop(ctypes.c_byte(device))
    assert dhd.dhdClose(ctypes.c_byte(device)) == 0
assert (dhd.dhdGetDeviceID(), counts()) == (-1, (2, 2))
json.dump(seen, open(sys.argv[1], "w"))
"""
BOTH = HD + DHD.replace("def position(", "def position_m(") + """
touch, omega = hd.hdInitDevice(None), dhd.dhdOpen()
assert (touch, omega, dhd.dhdGetDeviceCount()) == (0, 0, 1)
hd.hdEnable(0x4000)
hd.hdStartScheduler()
def frame(touch_n=0.5, omega_n=1.5):
    hd.hdBeginFrame(touch)
    hd.hdSetDoublev(0x2700, Vector(touch_n, 0, 0))
    hd.hdEndFrame(touch)
    dhd.dhdSetForce(0, omega_n, 0, omega)
dhd.dhdEnableForce(1, omega)
ticks(200, frame)
ticks(1, lambda: frame(0, 0))
hd.hdStopScheduler()
dhd.dhdStop(omega)
dhd.dhdClose(omega)
hd.hdDisableDevice(touch)
"""
class Touches(Devices):
    PLACES = {"left": [-30, 10, 5], "right": [20, -15, 0]}

    def both_hands(self, *more_of_right):
        hands = {side: self.file(side + ".toml", HOLD.format(place=place)) for side, place in self.PLACES.items()}
        return [*TOUCHES[:4], "--hand", hands["left"], *TOUCHES[4:], "--hand", hands["right"], *more_of_right]

    def test_frames_of_two_nest_and_each_has_its_hand_and_its_figures(self):
        code, report, seen, said = self.run_program(NESTED, options=self.both_hands())
        self.assertEqual([(one.get("of"), one["what"]) for one in report["misuse"]], [(None, "bad_handles")], said)
        self.assertEqual((code, seen["errors"]), (1, []), said)
        left, right = report["devices"]
        self.assertEqual([(one["device"], one["name"], one["misuse"]) for one in (left, right)],
                         [("touch", "Left", []), ("touch", "Right", [])])
        self.assertEqual((left["force"]["peak_n"], right["force"]["peak_n"]), (0.25, 0.5))
        self.near((left["force"]["given_peak_n"], right["force"]["given_peak_n"]), (0.25, 0.5), 0.001)
        for side in self.PLACES:
            self.near(seen[side], self.PLACES[side], 1.5)  # a hand gives way to its force
        again = self.run_program(NESTED, options=self.both_hands())[1]
        self.assertEqual([one["report_hash"] for one in again["devices"]], [left["report_hash"], right["report_hash"]])
        self.assertNotEqual(left["report_hash"], right["report_hash"])

    def test_a_frame_of_a_tick_is_one_of_its_device(self):
        _, report, _, said = self.run_program(ONE_FRAME, options=TOUCHES)
        self.assertEqual(report["exit_code"], 0, said)
        self.assertEqual({(one["of"], one["what"]) for one in report["misuse"]},
                         {("touch Right", "begins_refused"), ("touch Right", "ends_refused"), ("touch Right", "set_outside_frame")})
        suites = xml.etree.ElementTree.parse(self.folder / "report.xml").findall("testsuite")
        self.assertEqual([(suite.get("name"), suite.get("failures")) for suite in suites],
                         [("kerf stand-in", "0"), ("kerf stand-in touch Left", "0"), ("kerf stand-in touch Right", "3")])

    def test_a_fault_is_one_of_its_device(self):
        gone = str(ROOT / "hil/faults/gone.toml")
        _, report, seen, said = self.run_program(NESTED, options=self.both_hands("--fault", gone))
        self.assertEqual([(one["of"], one["what"]) for one in report["notes"]], [("touch Right", "lost_link")], said)
        self.assertEqual(seen["errors"], [[0x302, 1]])
        self.near(seen["left"], self.PLACES["left"], 1.5)

    def test_a_device_that_the_program_never_opens_is_misuse(self):
        program = HD + "hd.hdDisableDevice(hd.hdInitDevice(b'Default Device 2'))"
        code, report, _, said = self.run_program(program, options=["--device", "touch", "--device", "touch"])
        self.assertEqual((code, [(one["of"], one["what"]) for one in report["misuse"]]),
                         (1, [("touch Default Device", "not_opened")]), said)

class Omegas(Devices):
    def test_dhd_opens_what_is_free_and_an_id_names_its_device(self):
        hands = [self.file(f"{at}.toml", HOLD.format(place=[0, 5 * at, 0])) for at in range(2)]
        options = ["--device", "omega", "--hand", hands[0], "--device", "omega", "--hand", hands[1]]
        code, report, seen, said = self.run_program(OPENINGS, options=options)
        first, second = report["devices"]
        self.assertEqual(report["exit_code"], 0, said)
        self.assertEqual((code, self.misuse(report)), (1, ["bad_handles", "not_cleared"]), said)
        self.assertEqual((first["name"], second["name"]), ("omega.3", "omega.3 2"))
        self.assertEqual((first["force"]["peak_n"], second["force"]["peak_n"]), (2, 3))
        self.assertNotEqual(*seen)

    def test_one_program_has_a_touch_and_an_omega(self):
        code, report, _, said = self.run_program(BOTH, options=["--device", "touch", "--device", "omega"])
        self.assertEqual((code, report["misuse"]), (0, []), said)
        touch, omega = report["devices"]
        self.assertEqual((touch["force"]["peak_n"], omega["force"]["peak_n"]), (0.5, 1.5))
        self.assertEqual((touch["deadlines"]["ticks"], omega["deadlines"]["ticks"]), (201, 203))  # with the one that enables and the one that stops

class Names(Case):
    def test_a_device_without_a_name_gets_the_next_that_no_device_of_its_kind_has(self):
        touch, named = ["--device", "touch"], lambda name: ["--vendor-name", name]
        for options, names in (([*touch, *named("Default Device 2"), *touch], ["Default Device 2", "Default Device 3"]),
                               ([*touch, *touch, *named("Default Device")], ["Default Device 2", "Default Device"]),
                               ([*touch, *touch, *touch, *named("Default Device 2")],
                                ["Default Device", "Default Device 3", "Default Device 2"]),
                               ([*touch, *named("Left"), *touch, "--device", "omega", *named("Default Device 2")],
                                ["Left", "Default Device 2", "Default Device 2"]),
                               (["--device", "omega", *named("omega.3 2"), "--device", "omega"], ["omega.3 2", "omega.3 3"])):
            with self.subTest(options=options):
                _, report, said = self.run_command("true", options=options)
                self.assertEqual([device["name"] for device in report["devices"]] if report else None, names, said)


class BadInput(Case):
    def test_a_name_that_is_no_text_is_told_in_plain_characters(self):
        program = self.file("name.py", """
import ctypes
hd = ctypes.CDLL("libHD.so")
hd.hdInitDevice.argtypes = [ctypes.c_char_p]
for name in b"L\\xff\\n", b"\\x1b[31m", b"\\xed\\xa0\\x80", b"\\xc0\\xaf", b"\\xe2\\x82", "Z\u00e4hne \U0001f9b7".encode():
    hd.hdInitDevice(name)
""")
        _, _, said = self.run_command(*PYTHON, program)
        for name in (r"L\xff\n", r"\x1b[31m", r"\xed\xa0\x80", r"\xc0\xaf", r"\xe2\x82", "Z\u00e4hne \U0001f9b7"):
            self.assertIn(f"kerf stand-in libHD: {name}: no such device; open NULL", said)

    def test_devices_that_cannot_be_together_are_one_line(self):
        for options, word in ((["--device", "touch"] * 5, "at most 4 devices"),
                              (["--vendor-name", "L", "--device", "touch", "--device", "touch"], "--vendor-name L: two devices"),
                              ([*TOUCHES[:4], *TOUCHES[:4]], "--vendor-name Left: two devices"),
                              (["--device", "touch", "--vendor-name", "a,b"], "comma"),
                              (["--device", "touch", "--vendor-name", "a\nb"], "cannot be printed"),
                              (["--device", "touch", "--device", "touch", "--rate", "500"], "one servo thread"),
                              (["--device", "touch", "--device", "omega", "--hand", "/nowhere"], "--hand /nowhere"),
                              (["--device", "touch", "--device", "falcon"], "--device falcon: unknown")):
            with self.subTest(options=options):
                code, _, said = self.run_command("true", options=options)
                self.assertEqual((code, said.count("\n")), (2, 1), said)
                self.assertIn(word, said)


unittest.main(argv=sys.argv[:1], verbosity=1)
