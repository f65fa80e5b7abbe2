# SPDX-License-Identifier: Apache-2.0
"""`./kerf stand-in` with several devices, in one program and in two: which one a call is for, what each of them did, and how
many force commands it takes. In lock-step but for the last, whose bounds hold on a machine of any speed.

    devices_test.py ROOT PROGRAMS LIBRARIES"""
import json
import sys
import unittest
import xml.etree.ElementTree

from stand_in_case import ROOT, Case

PYTHON = ["/usr/bin/python3", "-B"]
TOUCHES = ["--device", "touch", "--vendor-name", "Left", "--device", "touch", "--vendor-name", "Right"]
OMEGAS = ["--device", "omega", "--device", "omega"]

HD = """
import ctypes, json, os, subprocess, sys, traceback
NONE = 0xFFFFFFFF
hd = ctypes.CDLL("libHD.so")
hd.hdInitDevice.restype = hd.hdGetCurrentDevice.restype = ctypes.c_uint
hd.hdInitDevice.argtypes = [ctypes.c_char_p]
hd.hdGetString.restype = ctypes.c_char_p
hd.hdScheduleAsynchronous.restype = ctypes.c_ulong
hd.hdGetError.restype = type("Error", (ctypes.Structure,), {"_fields_": [(name, ctypes.c_uint) for name in ("code", "own", "device")]})
Vector = ctypes.c_double * 3

def position():
    out = Vector()
    hd.hdGetDoublev(0x2050, out)
    return list(out)

def error():
    one = hd.hdGetError()
    return one.code, one.device

def expect(*wanted):
    got = [error() for _ in wanted]
    assert got == list(wanted) and error()[0] == 0, (got, wanted)

def ticks(count, call):
    left = [count]
    def tick(_data):
        try:
            call()
        except BaseException:
            traceback.print_exc()
            os._exit(3)  # ctypes would go on
        left[0] -= 1
        return 1 if left[0] else 0
    callback = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)(tick)
    hd.hdWaitForCompletion(ctypes.c_ulong(hd.hdScheduleAsynchronous(callback, None, 1)), 1)
"""
DHD = """
import ctypes, json, os, subprocess, sys, threading, time
dhd = ctypes.CDLL("libdrd.so.3")
dhd.dhdSetForce.argtypes = [ctypes.c_double] * 3 + [ctypes.c_byte]
dhd.dhdSleep.argtypes = [ctypes.c_double]
dhd.dhdGetTime.restype = ctypes.c_double

def position(device):
    out = [ctypes.c_double() for _ in range(3)]
    assert dhd.dhdGetPosition(*map(ctypes.byref, out), ctypes.c_byte(device)) >= 0
    return [one.value for one in out]
"""
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
# A second process takes what is free, and gets the vendor's words for what is not.
SECOND_HD = HD + """
def told(force):
    done = subprocess.run([sys.executable, sys.argv[1], force], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
hd.hdInitDevice(None)
first = told("1")
hd.hdDisableDevice(0)
assert first == json.loads(sys.argv[2]), first
assert told("0")[:2] == [0, 0]  # now that it is free
assert hd.hdInitDevice(None) == 0
hd.hdDisableDevice(0)
"""
ASK_HD = HD + """
device, pose = hd.hdInitDevice(b"Default Device"), None
if device == 0:
    hd.hdEnable(0x4000)
    for force in float(sys.argv[1]), 0:
        hd.hdBeginFrame(0)
        hd.hdSetDoublev(0x2700, Vector(force, 0, 0))
        pose = [round(x, 6) for x in position()]
        hd.hdEndFrame(0)
    hd.hdDisableDevice(0)
print(json.dumps([device, error()[0], pose]))
"""
SECOND_DHD = DHD + """
ask = '''
import ctypes
dhd = ctypes.CDLL("libdhd.so")
print(dhd.dhdGetDeviceCount(), dhd.dhdGetAvailableCount(), dhd.dhdOpenID(0), dhd.dhdErrorGetLast(), dhd.dhdOpen(),
      dhd.dhdOpen(), flush=True)
'''
def told(end):
    done = subprocess.run([sys.executable, "-c", ask + end], capture_output=True, text=True)
    return done.stdout.split()
assert dhd.dhdOpen() == 0
assert told("dhd.dhdClose(1)") == "2 1 -1 20 1 -1".split()
assert told("import os; os.kill(os.getpid(), 9)") == "2 1 -1 20 1 -1".split()
assert (dhd.dhdGetAvailableCount(), dhd.dhdOpen()) == (1, 1)  # the other one is gone
dhd.dhdClose(0)
assert told("dhd.dhdClose(0)") == "2 1 0 0 -1 -1".split()
dhd.dhdClose(1)
"""
# A child by fork has all open files of its parent, and sleeps while the parent closes and opens its devices.
FORKED = HD + DHD.replace("def position(", "def position_m(") + """
def child(work):
    number = os.fork()
    if number == 0:
        work()
        os._exit(0)
    return number
assert (hd.hdInitDevice(None), dhd.dhdOpen()) == (0, 0)
asleep = child(lambda: time.sleep(600))
for _ in range(2):
    hd.hdDisableDevice(0)
    assert dhd.dhdClose(0) == 0
    got = hd.hdInitDevice(None), error()[0], dhd.dhdOpen(), dhd.dhdErrorGetLast()
    if got != (0, 0, 0, 0): break
os.kill(asleep, 9)
os.waitpid(asleep, 0)
assert got == (0, 0, 0, 0), got
hd.hdDisableDevice(0)
dhd.dhdClose(0)
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
# Every slot of one device is asked for by eight threads; then one thread lets slots pass.
SLOTS = DHD + """
rate = 100
device = dhd.dhdOpen()
dhd.dhdEnableForce(1, device)
sent, refused, ends = [0] * 8, [0] * 9, threading.Event()  # refused: the emulator has had no processor for a while
def send(at):
    is_sent = dhd.dhdSetForce(0, 0, 0, device) >= 0
    refused[at] += not is_sent
    return is_sent
def work(at):
    while not ends.is_set():
        sent[at] += send(at)
began = dhd.dhdGetTime()
threads = [threading.Thread(target=work, args=(at,)) for at in range(len(sent))]
for thread in threads: thread.start()
time.sleep(1)
ends.set()
for thread in threads: thread.join()
most = (dhd.dhdGetTime() - began) * rate + 1
dhd.dhdClose(device)

device = dhd.dhdOpen()
dhd.dhdEnableForce(1, device)
first = dhd.dhdGetTime()
send(8)
then = dhd.dhdGetTime()
for pause in 0, 0.1, 0.02, 0:
    time.sleep(pause)
    last = dhd.dhdGetTime()
    send(8)
end = dhd.dhdGetTime()
dhd.dhdClose(device)
json.dump({"sent": sum(sent), "refused": sum(refused), "most": most, "slots": [(last - then) * rate - 1, (end - first) * rate + 1]}, open(sys.argv[1], "w"))
"""


class Devices(Case):
    def run_program(self, text, *words, options=(), lockstep=True):
        """The exit code, the report, what the program wrote, the lines for a person."""
        out = self.folder / "out.json"
        code, report, said = self.run_command(*PYTHON, self.file("program.py", text), *(words or [str(out)]), options=options,
                                              lockstep=lockstep)
        return code, report, json.loads(out.read_text()) if out.exists() else None, said

    def near(self, got, wanted, by):
        self.assertTrue(all(abs(a - b) <= by for a, b in zip(got, wanted, strict=True)), f"{got} and not {wanted}")


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

    def test_a_device_that_the_program_leaves_alone_is_told(self):
        program = HD + "hd.hdDisableDevice(hd.hdInitDevice(b'Default Device 2'))"
        code, report, _, said = self.run_program(program, options=["--device", "touch", "--device", "touch"])
        self.assertEqual((code, [(one["of"], one["what"]) for one in report["misuse"]]),
                         (1, [("touch Default Device", "not_opened")]), said)

    def test_a_second_process_gets_one_of_the_three_things_that_were_seen(self):
        ask = self.file("ask.py", ASK_HD)
        for word, wanted in (("timer", [0xFFFFFFFF, 0x304, None]), ("value", [0xFFFFFFFF, 0x101, None]),
                             ("pose", [0, 0, [0, -110, -35]])):
            with self.subTest(word=word):
                code, report, _, said = self.run_program(SECOND_HD, ask, json.dumps(wanted), options=["--switch", f"in-use={word}"])
                self.assertEqual((code, [one["what"] for one in report["notes"]]), (0, ["in_use"]), said)
                self.assertIn("note: 1 time that a program opened the device", said)
                self.assertEqual(report["force"]["given_peak_n"], 0)
        self.assertEqual(self.run_program(SECOND_HD, ask, json.dumps([0xFFFFFFFF, 0x304, None]))[0], 0)


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

    def test_a_second_process_gets_what_the_first_has_not(self):
        code, report, _, said = self.run_program(SECOND_DHD, options=OMEGAS)
        self.assertEqual((report["exit_code"], {(one["of"], one["what"]) for one in report["misuse"]}),
                         (0, {("omega omega.3 2", "left_open")}), said)  # the one that was killed
        self.assertEqual([(one["of"], one["what"], one["count"]) for one in report["notes"]], [("omega omega.3", "in_use", 2)])
        self.assertIn("note: omega omega.3: 2 times that a program", said)

    def test_one_program_has_a_touch_and_an_omega(self):
        code, report, _, said = self.run_program(BOTH, options=["--device", "touch", "--device", "omega"])
        self.assertEqual((code, report["misuse"]), (0, []), said)
        touch, omega = report["devices"]
        self.assertEqual((touch["force"]["peak_n"], omega["force"]["peak_n"]), (0.5, 1.5))
        self.assertEqual((touch["deadlines"]["ticks"], omega["deadlines"]["ticks"]), (201, 203))  # with the one that enables and the one that stops

    def test_a_child_by_fork_keeps_no_device_that_its_parent_has_closed(self):
        code, report, _, said = self.run_program(FORKED, options=["--device", "touch", "--device", "omega"])
        self.assertEqual((code, report["misuse"], report["notes"]), (0, [], []), said)

    def test_a_device_takes_its_rate_of_commands_from_all_threads_together(self):
        code, report, told, said = self.run_program(SLOTS, options=["--device", "omega", "--rate", "100"], lockstep=False)
        self.assertEqual((code, report["misuse"]), (0, []), said)
        self.assertLessEqual(told["sent"], told["most"])
        least, most = told["slots"]  # of the second part
        slots = report["force"]["commands"] + report["deadlines"]["missed_ticks"]
        self.assertGreaterEqual(slots + told["refused"], told["sent"] + least)
        self.assertLessEqual(slots, told["most"] + most)


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
