# SPDX-License-Identifier: Apache-2.0
"""Programs that call every function of an interface before they open a device, and after they have closed it: each call returns
with an error or without an effect, and the device then works as always. In lock-step.

    before_init_test.py ROOT PROGRAMS LIBRARIES"""
import json
import unittest

from stand_in_case import HERE, Case

HD = """
import ctypes, faulthandler, json, sys, threading
faulthandler.dump_traceback_later(60, exit=True)
hd = ctypes.CDLL("libHD.so")
hd.hdGetError.restype = type("Error", (ctypes.Structure,), {"_fields_": [(name, ctypes.c_uint) for name in "abc"]})
hd.hdGetString.restype = hd.hdGetErrorString.restype = ctypes.c_char_p
hd.hdScheduleAsynchronous.restype = ctypes.c_ulong
hd.hdInitDevice.restype = hd.hdGetCurrentDevice.restype = hd.hdCheckCalibration.restype = ctypes.c_uint
hd.hdGetSchedulerTimeStamp.restype = ctypes.c_double
hd.hdScaleGimbalAngles.argtypes = [ctypes.c_double] * 3 + [ctypes.c_void_p]
kind = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)
buffer = (ctypes.c_ubyte * 256)(*[0xA5] * 256)
frames = []

def frame(_data):
    hd.hdBeginFrame(hd.hdGetCurrentDevice())
    hd.hdGetDoublev(0x2050, buffer)
    hd.hdSetDoublev(0x2700, (ctypes.c_double * 3)(1, 0, 0))
    hd.hdEndFrame(hd.hdGetCurrentDevice())
    frames.append(1)
    return 0

frame = kind(frame)
calls = {
    "MakeCurrentDevice": (0,), "DisableDevice": (0,), "BeginFrame": (0,), "EndFrame": (0,), "GetCurrentDevice": (),
    "Enable": (0x4000,), "Disable": (0x4000,), "IsEnabled": (0x4000,),
    **{"Get" + kind + "v": (0x2050, buffer) for kind in ("Boolean", "Integer", "Float", "Double", "Long")},
    **{"Set" + kind + "v": (0x2700, buffer) for kind in ("Boolean", "Integer", "Float", "Double", "Long")},
    "GetString": (0x2501,), "GetErrorString": (0x104,), "GetError": (), "CheckCalibration": (), "UpdateCalibration": (4,),
    "CheckCalibrationStyle": (), "UpdateCalibrationMessage": (4,), "ScaleGimbalAngles": (1, 1, 1, buffer),
    "DeploymentLicense": (b"a", b"b", b"c"), "Unschedule": (ctypes.c_ulong(5),), "WaitForCompletion": (ctypes.c_ulong(5), 1),
    "SetSchedulerRate": (ctypes.c_ulong(1000),), "ScheduleSynchronous": (frame, None, 5), "GetSchedulerTimeStamp": (),
    "StopScheduler": (), "StartScheduler": (), "StopScheduler ": ()}

def call_all():
    found = {}
    for name, words in calls.items():
        getattr(hd, "hd" + name.strip())(*words)
        errors = []
        while code := hd.hdGetError().a:
            errors.append(code)
        found[name.strip()] = errors
    return found

told = {"before": call_all(), "untouched": bytes(buffer) == b"\\xa5" * 256}
waiting = ctypes.c_ulong(hd.hdScheduleAsynchronous(frame, None, 5))  # and one that waits for a scheduler
del frames[:]
device = hd.hdInitDevice(None)
hd.hdEnable(0x4000)
hd.hdStartScheduler()
hd.hdWaitForCompletion(waiting, 1)
hd.hdScheduleSynchronous(frame, None, 1)
told["frames"] = len(frames)
zero = kind(lambda _data: hd.hdBeginFrame(device) and 0 or hd.hdEndFrame(device) and 0)
hd.hdScheduleSynchronous(zero, None, 1)
hd.hdStopScheduler()
while hd.hdGetError().a: pass
hd.hdDisableDevice(device)
told["errors"] = hd.hdGetError().a
told["after"] = call_all()
with open(sys.argv[1], "w") as file: json.dump(told, file)
"""
# Every name, with nothing in all arguments, and then with room for each pointer.
DHD = """
import ctypes, faulthandler, json, sys
faulthandler.dump_traceback_later(60, exit=True)
dhd = ctypes.CDLL("libdrd.so.3")
dhd.dhdErrorGetLastStr.restype = ctypes.c_char_p
buffer = (ctypes.c_ubyte * 4096)(*[0xA5] * 4096)
at = ctypes.addressof(buffer)

written = []

def call_all(fill):
    found = {}
    for name in json.loads(sys.argv[2]):
        function = getattr(dhd, name)
        function.restype = ctypes.c_double if name in json.loads(sys.argv[3]) else ctypes.c_int
        result = function(*[ctypes.c_void_p(fill)] * 8)
        found[name] = [result, dhd.dhdErrorGetLast()]
        if bytes(buffer) != b"\\xa5" * 4096:
            written.append(name)
            ctypes.memset(buffer, 0xA5, 4096)
    return found

told = {"nothing": call_all(0), "room": call_all(at), "written": written}
dhd.dhdSetForce.argtypes = [ctypes.c_double] * 3 + [ctypes.c_byte]
told["opened"] = dhd.dhdOpen()
dhd.dhdEnableForce(1, -1)
told["forces"] = [dhd.dhdSetForce(1, 0, 0, -1) for _ in range(50)]
dhd.dhdStop(-1)
told["closed"] = dhd.dhdClose(-1)
del dhd.dhdSetForce.argtypes
told["after"] = call_all(0)
with open(sys.argv[1], "w") as file: json.dump(told, file)
"""
OPENING = {"dhdOpen", "dhdOpenID", "dhdOpenSerial", "dhdOpenType", "drdOpen", "drdOpenID"}
# Of no device: they succeed, or return what they are asked for.
OF_NO_DEVICE = {"dhdGetDeviceCount", "dhdGetAvailableCount", "dhdGetSDKVersion", "dhdErrorGetLast", "dhdErrorGetLastStr",
                "dhdErrorGetStr", "dhdEnableExpertMode", "dhdDisableExpertMode", "dhdEnableSimulator", "dhdGetTime", "dhdSleep",
                "dhdKbHit", "dhdKbGet", "drdWaitForTick"}
# bool, const char* (none) and unsigned: no part of a device, no name, no button
FALSE = {"dhdHasBase", "dhdHasWrist", "dhdHasActiveWrist", "dhdHasGripper", "dhdHasActiveGripper", "dhdIsLeftHanded",
         "dhdGetSystemName", "dhdGetButtonMask", "drdIsInitialized", "drdIsSupported", "drdIsRunning", "drdIsMoving", "drdIsFiltering"}
# functions that return a double
NUMBERS = {"dhdGetComFreq", "drdGetCtrlFreq", "dhdGetMaxForce", "dhdGetMaxTorque", "dhdGetMaxGripperForce", "drdGetEncPGain",
           "drdGetEncIGain", "drdGetEncDGain", "drdGetMotRatioMax"}


class BeforeInit(Case):
    def tell(self, text, *words, options=()):
        out = self.folder / "told.json"
        code, report, said = self.run_command("/usr/bin/python3", "-B", self.file("program.py", text), str(out), *words, options=options)
        self.assertEqual((report["exit_code"], code), (0, 1), said)
        return json.loads(out.read_text()), report

    def test_hd(self):
        told, report = self.tell(HD)
        self.assertEqual(self.misuse(report), ["bad_handles", "bad_schedules"])
        self.assertTrue(told["untouched"])
        needs = {"MakeCurrentDevice", "DisableDevice", "BeginFrame", "EndFrame", "Enable", "Disable", "IsEnabled", "GetString",
                 "CheckCalibration", "UpdateCalibration", "ScaleGimbalAngles",
                 *(do + kind + "v" for do in ("Get", "Set") for kind in ("Boolean", "Integer", "Float", "Double", "Long"))}
        for when in ("before", "after"):
            for name, errors in told[when].items():
                with self.subTest(when=when, name=name):
                    wanted = [0x104] if name in needs else [0x101] if name == "Unschedule" else []
                    self.assertEqual(errors, [0x104] * 4 if name == "ScheduleSynchronous" else wanted)
        self.assertEqual((told["frames"], told["errors"]), (2, 0))  # of the one that waited, and of the one asked for
        self.assertAlmostEqual(report["force"]["given_peak_n"], 1, 3)

    def test_dhd(self):
        names = [name for name in (HERE / "dhd_names.txt").read_text().split() if name not in OPENING]
        told, report = self.tell(DHD, json.dumps(names), json.dumps(sorted(NUMBERS)), options=["--device", "omega"])
        self.assertEqual(self.misuse(report), ["bad_handles"])
        self.assertEqual(told["written"], ["dhdGetSDKVersion"])
        self.assertEqual((told["opened"], told["closed"], told["forces"]), (0, 0, [0] * 50))
        for when in ("nothing", "room", "after"):
            for name, (result, error) in told[when].items():
                with self.subTest(when=when, name=name):
                    if name in OF_NO_DEVICE:
                        continue
                    if name in FALSE:
                        self.assertEqual(result & 0xFF if name not in ("dhdGetSystemName", "dhdGetButtonMask") else result, 0)
                    else:
                        self.assertEqual(result, 0 if name == "dhdGetComFreq" else -1)
                        self.assertNotEqual(error, 0)
        self.assertAlmostEqual(report["force"]["given_peak_n"], 1, 3)


unittest.main(verbosity=1, argv=["before_init_test.py"])
