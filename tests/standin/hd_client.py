# SPDX-License-Identifier: Apache-2.0
"""A small haptic program on the HD interface, by ctypes: it knows libHD.so by its names alone and nothing of kerf.

    python3 hd_client.py WHAT COUNT OUT.json

WHAT: spring, a closed loop towards the origin for COUNT ticks; or a kind of misuse. OUT.json gets what the program itself
measured."""
import ctypes
import json
import math
import sys
import time

SUCCESS, CONTINUE, DONE = 0, 1, 0
BUTTONS, POSITION, TRANSFORM, FORCE = 0x2000, 0x2050, 0x2052, 0x2700
FORCE_OUTPUT = 0x4000
STIFFNESS_N_PER_MM = 0.04
MOST_N = 1.5
REST = 1500  # ticks of no force at the end, in which the hand comes to rest


class ErrorInfo(ctypes.Structure):
    _fields_ = [("code", ctypes.c_uint), ("internal", ctypes.c_int), ("device", ctypes.c_uint)]


hd = ctypes.CDLL("libHD.so")
hd.hdInitDevice.restype = ctypes.c_uint
hd.hdInitDevice.argtypes = [ctypes.c_char_p]
hd.hdGetError.restype = ErrorInfo
hd.hdGetString.restype = ctypes.c_char_p
hd.hdScheduleAsynchronous.restype = ctypes.c_ulong
hd.hdUnschedule.argtypes = hd.hdWaitForCompletion.argtypes = None
CALLBACK = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)
Vector = ctypes.c_double * 3


def read(name, kind=Vector):
    out = kind()
    hd.hdGetDoublev(name, out)
    return list(out)


class Program:
    def __init__(self, what, count):
        self.what, self.count = what, count
        self.positions, self.forces, self.buttons = [], [], 0
        self.device = hd.hdInitDevice(None)
        if hd.hdGetError().code != SUCCESS:
            sys.exit("no device")

    def force(self, position):
        if self.what == "spring" or self.what in ("open_frame", "killed", "not_cleared", "no_close"):
            pull = [-STIFFNESS_N_PER_MM * x for x in position]
            return [f * min(1, MOST_N / max(math.hypot(*pull), 1e-9)) for f in pull]
        return [math.nan, 0.0, 0.0] if self.what == "nan" else [0.0, 0.0, 0.0]

    def tick(self, _data):
        hd.hdBeginFrame(self.device)
        position = read(POSITION)
        force = self.force(position)
        buttons = ctypes.c_int()
        hd.hdGetIntegerv(BUTTONS, ctypes.byref(buttons))
        self.buttons |= buttons.value
        last = len(self.positions) + 1 >= self.count
        if self.what == "spring" and len(self.positions) >= self.count - REST:
            force = [0.0, 0.0, 0.0]
        hd.hdSetDoublev(FORCE, Vector(*force))
        self.positions.append(position)
        self.forces.append(force)
        if self.what == "twice" and len(self.positions) == 3:
            hd.hdBeginFrame(self.device)
        if self.what == "stall" and len(self.positions) == 3:
            time.sleep(0.2)
        if not (self.what == "open_frame" and len(self.positions) % 10 == 5):
            hd.hdEndFrame(self.device)
        if self.what == "outside":
            hd.hdSetDoublev(FORCE, Vector(1, 0, 0))
        if self.what == "end_twice" and len(self.positions) == 3:
            hd.hdEndFrame(self.device)
        return DONE if last else CONTINUE

    def run(self):
        hd.hdEnable(FORCE_OUTPUT)
        callback = CALLBACK(self.tick)
        hd.hdStartScheduler()
        handle = hd.hdScheduleAsynchronous(callback, None, 0x7FFF)
        hd.hdWaitForCompletion(ctypes.c_ulong(handle), 1)
        if self.what == "killed":
            import os
            os.kill(os.getpid(), 9)
        if self.what == "bad_handle":
            hd.hdBeginFrame(17)
            hd.hdUnschedule(ctypes.c_ulong(4711))
        hd.hdStopScheduler()
        if self.what != "no_close":
            hd.hdDisableDevice(self.device)

    def report(self):
        errors = []
        while (error := hd.hdGetError().code) != SUCCESS:
            errors.append(error)
        steps = zip(self.forces, self.positions, self.positions[1:])
        lengths = [math.hypot(*force) for force in self.forces]
        return {"ticks": len(self.positions), "peak_n": max(lengths), "first_mm": self.positions[0],
                "rms_n": math.sqrt(sum(f * f for f in lengths) / len(lengths)),
                "work_mj": sum(f * (b - a) for force, here, there in steps for f, a, b in zip(force, here, there)),
                "last_mm": self.positions[-1], "buttons": self.buttons, "errors": errors, "vendor": self.vendor}


def main():
    what, count, out = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    program = Program(what, count)
    program.vendor = hd.hdGetString(0x2503).decode()
    program.run()
    with open(out, "w", encoding="utf-8") as file:
        json.dump(program.report(), file)


main()
