# SPDX-License-Identifier: Apache-2.0
"""A device of `./kerf stand-in` that two processes, a parent and its child, or eight threads want: who gets it, and how many force
commands it takes. In lock-step but for the threads, whose bounds hold on a machine of any speed.

    shared_devices_test.py ROOT PROGRAMS LIBRARIES"""
import json
import sys
import unittest

from devices_case import DHD, HD, Devices

OMEGAS = ["--device", "omega", "--device", "omega"]
# A second process takes what is free, and gets the vendor's words for what is not.
SECOND_HD = HD + """
def asked(force):
    done = subprocess.run([sys.executable, sys.argv[1], force], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
hd.hdInitDevice(None)
first = asked("1")
hd.hdDisableDevice(0)
assert first == json.loads(sys.argv[2]), first
assert asked("0")[:2] == [0, 0]  # now that it is free
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
def asked(end):
    done = subprocess.run([sys.executable, "-c", ask + end], capture_output=True, text=True)
    return done.stdout.split()
assert dhd.dhdOpen() == 0
assert asked("dhd.dhdClose(1)") == "2 1 -1 20 1 -1".split()
assert asked("import os; os.kill(os.getpid(), 9)") == "2 1 -1 20 1 -1".split()
assert (dhd.dhdGetAvailableCount(), dhd.dhdOpen()) == (1, 1)  # the other one is gone
dhd.dhdClose(0)
assert asked("dhd.dhdClose(0)") == "2 1 0 0 -1 -1".split()
dhd.dhdClose(1)
"""
# A locked-out Touch ("pose") has no emulator to wait for: a tick of it lasts as long as one of the device.
LOCKED_OUT = HD + """
import time
ask = '''
import sys, time
exec(sys.stdin.read())
assert hd.hdInitDevice(None) == 0
hd.hdStartScheduler()
began = time.monotonic()
ticks(300, lambda: None)
took = time.monotonic() - began
hd.hdStopScheduler()
print(took)
'''
hd.hdInitDevice(None)
done = subprocess.run([sys.executable, "-c", ask], input=sys.argv[2], capture_output=True, text=True)
hd.hdDisableDevice(0)
assert done.returncode == 0, done.stderr
open(sys.argv[1], "w").write(done.stdout)
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


class Processes(Devices):
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

    def test_a_second_process_gets_what_the_first_has_not(self):
        code, report, _, said = self.run_program(SECOND_DHD, options=OMEGAS)
        self.assertEqual((report["exit_code"], {(one["of"], one["what"]) for one in report["misuse"]}),
                         (0, {("omega omega.3 2", "left_open")}), said)  # the one that was killed
        self.assertEqual([(one["of"], one["what"], one["count"]) for one in report["notes"]], [("omega omega.3", "in_use", 2)])
        self.assertIn("note: omega omega.3: 2 times that a program", said)

    def test_a_tick_of_a_touch_that_is_locked_out_waits(self):
        out = str(self.folder / "out.json")
        _, _, got, said = self.run_program(LOCKED_OUT, out, HD, options=["--switch", "in-use=pose"])
        self.assertGreaterEqual(got, 0.299, said)  # of 1000 a second

    def test_a_child_by_fork_keeps_no_device_that_its_parent_has_closed(self):
        code, report, _, said = self.run_program(FORKED, options=["--device", "touch", "--device", "omega"])
        self.assertEqual((code, report["misuse"], report["notes"]), (0, [], []), said)


class Threads(Devices):
    def test_a_device_takes_its_rate_of_commands_from_all_threads_together(self):
        code, report, got, said = self.run_program(SLOTS, options=["--device", "omega", "--rate", "100"], lockstep=False)
        self.assertEqual((code, report["misuse"]), (0, []), said)
        self.assertLessEqual(got["sent"], got["most"])
        least, most = got["slots"]  # of the second part
        slots = report["force"]["commands"] + report["deadlines"]["missed_ticks"]
        self.assertGreaterEqual(slots + got["refused"], got["sent"] + least)
        self.assertLessEqual(slots, got["most"] + most)


unittest.main(argv=sys.argv[:1], verbosity=1)
