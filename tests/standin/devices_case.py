# SPDX-License-Identifier: Apache-2.0
"""What the tests of `./kerf stand-in` with several devices share: the head of their programs, HD or DHD, and how one is run."""
import json

from stand_in_case import Case

PYTHON = ["/usr/bin/python3", "-B"]
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


class Devices(Case):
    def run_program(self, text, *words, options=(), lockstep=True):
        """The exit code, the report, what the program wrote, the lines for a person."""
        out = self.folder / "out.json"
        code, report, said = self.run_command(*PYTHON, self.file("program.py", text), *(words or [str(out)]), options=options,
                                              lockstep=lockstep)
        return code, report, json.loads(out.read_text()) if out.exists() else None, said

    def near(self, got, wanted, by):
        self.assertTrue(all(abs(a - b) <= by for a, b in zip(got, wanted, strict=True)), f"{got} and not {wanted}")
