# SPDX-License-Identifier: Apache-2.0
"""Programs on the HD and the dhd interface, by ctypes, that note what they read and what comes of what they set:

    published_client.py hd|dhd|fast OUT.json      behind `./kerf stand-in --lockstep`; for published_test.py"""
import ctypes
import json
import math
import pathlib
import sys

TICKS = 3000
Three, Sixteen, Six = ctypes.c_double * 3, ctypes.c_double * 16, ctypes.c_double * 6


def joints_to_mm(j):
    r = 133.35 * (math.cos(j[1]) + math.sin(j[2]))
    return [-math.sin(j[0]) * r, 133.35 * (math.sin(j[1]) - math.cos(j[2])) + 23.35, math.cos(j[0]) * r - 168.35]


def transposed_jacobian_times(j, force):
    """Torques in N mm, which are mNm, by differences of the position."""
    torques = []
    for axis in range(3):
        more, less = ([angle + (side if i == axis else 0) for i, angle in enumerate(j)] for side in (1e-6, -1e-6))
        torques.append(sum(f * (a - b) / 2e-6 for f, a, b in zip(force, joints_to_mm(more), joints_to_mm(less))))
    return torques


class HdProgram:
    def __init__(self):
        self.hd = hd = ctypes.CDLL("libHD.so")

        class ErrorInfo(ctypes.Structure):
            _fields_ = [("code", ctypes.c_uint), ("internal", ctypes.c_int), ("device", ctypes.c_uint)]
        hd.hdInitDevice.restype, hd.hdGetError.restype = ctypes.c_uint, ErrorInfo
        hd.hdScheduleAsynchronous.restype = ctypes.c_ulong
        self.device = hd.hdInitDevice(None)
        self.frames, self.tries, self.figures = [], {}, {}

    def read(self, name, kind=Three):
        out = kind()
        self.hd.hdGetDoublev(name, out)
        return list(out)

    def scaled_gimbal(self, scale):
        out = Sixteen()
        self.hd.hdScaleGimbalAngles(ctypes.c_double(scale), ctypes.c_double(scale), ctypes.c_double(scale), out)
        return list(out)

    def write(self, name, *values):
        self.hd.hdSetDoublev(name, (ctypes.c_double * len(values))(*values))

    def errors(self):
        found = []
        while code := self.hd.hdGetError().code:
            found.append(code)
        return found

    def frame(self, what):
        self.hd.hdBeginFrame(self.device)
        result = what()
        self.hd.hdEndFrame(self.device)
        return result

    def tick(self, _data):
        tick = len(self.frames)
        self.frames.append(self.frame(lambda: {
            "position": self.read(0x2050), "velocity": self.read(0x2051), "turning": self.read(0x2053),
            "transform": self.read(0x2052, Sixteen), "joints": self.read(0x2100), "gimbal": self.read(0x2150),
            "scaled": self.scaled_gimbal(0.5), "last_position": self.read(0x2250), "last_velocity": self.read(0x2251), "last_joints": self.read(0x2300)}
            | self.act(tick)))
        self.frames[-1]["errors"] = self.errors()
        return 0 if tick + 1 >= TICKS else 1

    def act(self, tick):
        """In a frame. What is set in one is told as the last force in the next."""
        told = {"last_force": self.read(0x2800)}
        if 2000 <= tick < 2100:  # a force that no Touch gives
            self.write(0x2700, 5 * min(1, (tick - 2000) / 50), 0, 0)
        if 2200 <= tick < 2300:  # J^T of (0.5, -0.3, 0.2) N at the joints of this frame, in mNm
            told["torque"] = transposed_jacobian_times(self.read(0x2100), [0.5, -0.3, 0.2])
            self.write(0x2703, *told["torque"])
        if 2400 <= tick < 2600:  # half of the speed of the hand, then twice, as the limit
            self.write(0x2606, 50.0 if tick < 2500 else 1e4)
            self.write(0x2700, 0.2, 0, 0)
        return told

    def run(self):
        hd = self.hd
        hd.hdEnable(0x4000)
        callback = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)(self.tick)
        for name, kind in ((0x2550, Six), (0x2551, Six), *((name, Three) for name in (
                0x2552, 0x2600, 0x2601, 0x2602, 0x2603, 0x2604, 0x2605, 0x2606, 0x2607, 0x2609))):
            self.figures[hex(name)] = self.read(name, kind)
        whole = ctypes.c_int()
        for name in (0x2553, 0x2554, 0x2555):
            hd.hdGetIntegerv(name, ctypes.byref(whole))
            self.figures[hex(name)] = whole.value
        self.figures["errors"] = self.errors()
        hd.hdStartScheduler()
        handle = hd.hdScheduleAsynchronous(callback, None, 0x7FFF)
        hd.hdWaitForCompletion(ctypes.c_ulong(handle), 1)
        hd.hdStopScheduler()
        hd.hdDisableDevice(self.device)
        return {"frames": self.frames, "figures": self.figures}


class DhdProgram:
    def __init__(self):
        self.dhd = dhd = ctypes.CDLL("libdrd.so.3")
        dhd.dhdSetForce.argtypes = [ctypes.c_double] * 3 + [ctypes.c_byte]
        dhd.dhdSetMaxForce.argtypes = [ctypes.c_double, ctypes.c_byte]
        dhd.dhdGetComFreq.restype = dhd.dhdGetMaxForce.restype = dhd.dhdGetTime.restype = ctypes.c_double
        dhd.dhdSleep.argtypes = [ctypes.c_double]
        dhd.dhdSetDeviceAngleDeg.argtypes = dhd.dhdSetBaseAngleZRad.argtypes = [ctypes.c_double, ctypes.c_byte]
        dhd.dhdOpen()

    def read(self, function):
        out = [ctypes.c_double() for _ in range(3)]
        code = function(*map(ctypes.byref, out), -1)
        return [one.value for one in out] if code >= 0 else code

    def step(self, *force):
        return self.dhd.dhdSetForce(*force, -1)

    def status(self):
        words = (ctypes.c_int * 17)()
        self.dhd.dhdGetStatus(words, -1)
        return list(words)

    def fast(self):
        """The fastest part of the velocity and the mode after it, under a threshold of 1 m/s."""
        self.dhd.dhdEnableExpertMode()
        self.step(0, 0, 0)
        self.dhd.dhdSetVelocityThreshold(ctypes.c_uint(1), -1)
        told = []
        for _ in range(2000):
            self.step(0, 0, 0.1)
            velocity = self.read(self.dhd.dhdGetLinearVelocity)
            told.append([max(map(abs, velocity)) if isinstance(velocity, list) else 0, self.status()[4:7], self.status()[14]])
        return told

    def run(self):
        dhd, told = self.dhd, {"frames": []}
        told["watchdog without expert mode"] = [dhd.dhdSetWatchdog(ctypes.c_ubyte(160), -1), dhd.dhdErrorGetLast()]
        for _ in range(2000):
            told["frames"].append({"position": self.read(dhd.dhdGetPosition), "velocity": self.read(dhd.dhdGetLinearVelocity)})
            self.step(0, 0, 0)
        told["kHz"] = dhd.dhdGetComFreq(-1)
        told["too strong"] = [self.step(0, 0, 13), self.read(dhd.dhdGetForce), self.step(0, 0, 0)]
        dhd.dhdSetMaxForce(2.5, -1)
        told["limited"] = [self.step(3, 0, 4), self.read(dhd.dhdGetForce), dhd.dhdGetMaxForce(-1)]
        dhd.dhdSetMaxForce(-1, -1)
        angle = ctypes.c_double()
        dhd.dhdSetDeviceAngleDeg(90, -1)
        dhd.dhdGetDeviceAngleRad(ctypes.byref(angle), -1)
        told["90 degrees"] = angle.value
        dhd.dhdSetBaseAngleZRad(math.pi / 6, -1)
        dhd.dhdGetBaseAngleZDeg(ctypes.byref(angle), -1)
        told["pi/6"] = angle.value
        dhd.dhdEnableExpertMode()
        # The hand's fastest is 0.1 to 0.2 m/s: a threshold of 1 m/s holds, though it is more than 1 mm/s.
        dhd.dhdSetVelocityThreshold(ctypes.c_uint(1), -1)
        modes = set()
        for _ in range(900):
            self.step(0.1, 0, 0)
            modes.add(tuple(self.status()[4:7]))
        told["modes below 1 m/s"] = sorted(modes)
        dhd.dhdSetVelocityThreshold(ctypes.c_uint(0), -1)
        dhd.dhdSetWatchdog(ctypes.c_ubyte(160), -1)  # 20 ms
        self.step(0.1, 0, 0)
        before = dhd.dhdGetTime()
        dhd.dhdSleep(0.0185)
        told["after 18 ms"] = [self.status()[5:7], dhd.dhdGetTime() - before]
        dhd.dhdSleep(0.004)
        told["after 23 ms"] = [self.status()[5:7], self.status()[14]]
        dhd.dhdClose(-1)
        return told


if __name__ == "__main__":
    RUNS = {"hd": lambda: HdProgram().run(), "dhd": lambda: DhdProgram().run(), "fast": lambda: DhdProgram().fast()}
    pathlib.Path(sys.argv[2]).write_text(json.dumps(RUNS[sys.argv[1]]()))
