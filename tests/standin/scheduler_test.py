# SPDX-License-Identifier: Apache-2.0
"""The scheduler of `./kerf stand-in`'s HD: order of callbacks, and when a call returns.

    scheduler_test.py ROOT PROGRAMS LIBRARIES"""
import sys
import unittest

from stand_in_case import Case

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


unittest.main(argv=sys.argv[:1], verbosity=1)
