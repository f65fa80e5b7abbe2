# SPDX-License-Identifier: Apache-2.0
"""What a Touch of the stand-in tells of itself: how many numbers each parameter writes, its wrist on the way of a hand, how warm
its motors are. In lock-step.

    touch_test.py ROOT PROGRAMS LIBRARIES"""
import json
import math
import unittest

from stand_in_case import Case

# By the interface's documents, as pages of clients have them: parameter (hex), number of values, getters that have it.
FLOATS, ANY, LONG, BOOL, INT = ("Floatv", "Doublev"), ("Floatv", "Doublev", "Integerv", "Longv"), ("Longv",), ("Booleanv",), \
    ("Integerv", "Longv")
READ = [(0x2000, 1, ANY), (0x2002, 1, BOOL), (0x2010, 6, LONG), (0x2050, 3, FLOATS), (0x2051, 3, FLOATS), (0x2052, 16, FLOATS),
        (0x2053, 3, FLOATS), (0x2100, 3, FLOATS), (0x2150, 3, FLOATS),
        (0x2200, 1, ANY), (0x2202, 1, BOOL), (0x2210, 6, LONG), (0x2250, 3, FLOATS), (0x2251, 3, FLOATS), (0x2252, 16, FLOATS),
        (0x2253, 3, FLOATS), (0x2300, 3, FLOATS), (0x2350, 3, FLOATS),
        (0x2505, 1, ANY), (0x2550, 6, FLOATS), (0x2551, 6, FLOATS), (0x2552, 1, ANY), (0x2553, 1, INT), (0x2554, 1, INT),
        (0x2555, 1, INT), (0x2600, 1, ANY), (0x2601, 1, ANY), (0x2602, 1, FLOATS), (0x2603, 1, FLOATS), (0x2604, 1, FLOATS),
        (0x2605, 3, FLOATS), (0x2606, 1, FLOATS), (0x2607, 1, FLOATS), (0x2608, 1, FLOATS), (0x2609, 1, FLOATS),
        (0x2700, 3, FLOATS), (0x2701, 3, FLOATS), (0x2703, 3, FLOATS), (0x2704, 3, FLOATS), (0x2800, 3, FLOATS),
        (0x2801, 3, FLOATS), (0x2802, 3, FLOATS), (0x2803, 3, FLOATS)]
LEFT_OUT = [0x2001, 0x2011, 0x2012, 0x2054, 0x2201, 0x2254, 0x2620, 0x2621, 0x2622, 0x2623, 0x2702, 0x2750, 0x2850]
NO_READING = [0x1234, 0x2003, 0x2055, 0x2500, 0x2705, 0x2900, 0x2905, 0x4000]  # unknown, a text, one that is only set
PROGRAM = """
import ctypes, json, sys
hd = ctypes.CDLL("libHD.so")
hd.hdGetError.restype = type("Error", (ctypes.Structure,), {"_fields_": [(name, ctypes.c_uint) for name in "abc"]})
hd.hdScheduleAsynchronous.restype = ctypes.c_ulong
hd.hdWaitForCompletion.argtypes = [ctypes.c_ulong, ctypes.c_uint]
device = hd.hdInitDevice(None)
hd.hdEnable(0x4000)

def read(name, count, getter="Doublev", kind=ctypes.c_double):
    out = (kind * count)()
    getattr(hd, "hdGet" + getter)(name, out)
    return list(out)

def run(tick, count):
    # calls tick(i) in a frame each
    left, calls = [count], ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)
    def call(_data):
        hd.hdBeginFrame(device)
        tick(count - left[0])
        hd.hdEndFrame(device)
        left[0] -= 1
        return 1 if left[0] else 0
    call = calls(call)
    hd.hdStartScheduler()
    hd.hdWaitForCompletion(hd.hdScheduleAsynchronous(call, None, 1), 1)
    hd.hdStopScheduler()

def force(*newtons):
    hd.hdSetDoublev(0x2700, (ctypes.c_double * 3)(*newtons))

def errors():
    found = []
    while code := hd.hdGetError().a:
        found.append(code)
    return found

"""
END = """
hd.hdDisableDevice(device)
with open(sys.argv[1], "w") as file: json.dump(told, file)
"""
COUNTS = """
told = []
types = {"Booleanv": ctypes.c_ubyte, "Integerv": ctypes.c_int, "Floatv": ctypes.c_float, "Doublev": ctypes.c_double,
         "Longv": ctypes.c_long}
names = json.loads(sys.argv[2])
def tick(i):
    force(0.25, 0.5, 0.125)
    if i < 99: return
    errors()
    for name in names:
        for getter, kind in types.items():
            size = 40 * ctypes.sizeof(kind)
            out = (ctypes.c_ubyte * size)(*[0xA5] * size)
            getattr(hd, "hdGet" + getter)(name, out)
            each = ctypes.sizeof(kind)
            changed = [bytes(out)[i:i + each] != b"\\xa5" * each for i in range(0, size, each)]
            told.append([name, getter, changed, errors()])
run(tick, 100)
"""
# Upright, to the sides and turned: its own angles in degrees go through what a wrist cannot do.
WAY = """
unit_mm = 1.0
start_mm = [0, 5, 0]
[[step]]
move_mm = [0, 5, -60]
seconds = 0.4
[[step]]
move_mm = [60, -40, 0]
orientation_deg = [40, -60, 0]
seconds = 0.4
[[step]]
move_mm = [-60, 40, 20]
orientation_deg = [-200, 40, 120]
seconds = 0.6
[[step]]
move_mm = [0, 0, 0]
orientation_deg = [0, 0, 0]
seconds = 0.6
[[step]]
hold = 5
"""
MOTION = """
told = []
def tick(_i):
    told.append({"joints": read(0x2100, 3), "gimbal": read(0x2150, 3), "transform": read(0x2052, 16),
                 "turning": read(0x2053, 3), "encoders": read(0x2010, 6, "Longv", ctypes.c_long)})
run(tick, 5000)
told.append(errors())
"""
HEAT = """
told = {"temperatures": [], "errors": []}
def tick(i):
    force(0, 0, 0.7 if i < 2000 else 3.0 if i < 3500 else 0)
    told["temperatures"].append(read(0x2605, 3))
    told["errors"] += [[i, code] for code in errors()]
run(tick, 15000)
"""
MOST_RAD = (2.45, 1.23, 2.38)  # half of the joints' spans that clients' robot models and drivers have


def about(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    return {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]], "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis]


def product(a, *others):
    for b in others:
        a = [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    return a


class Touch(Case):
    def tell(self, text, *words, options=(), misuse=()):
        out = self.folder / "told.json"
        code, report, said = self.run_command("/usr/bin/python3", "-B", self.file("program.py", PROGRAM + text + END), str(out), *words,
                                              options=options)
        self.assertEqual((report["exit_code"], self.misuse(report)), (0, list(misuse)), said)
        self.assertEqual(code, 1 if misuse else 0)
        return json.loads(out.read_text()), report

    def test_each_parameter_writes_as_many_numbers_as_it_has(self):
        names = [name for name, _, _ in READ] + LEFT_OUT + NO_READING
        told, _ = self.tell(COUNTS, json.dumps(names), misuse=["not_cleared"])
        wanted = {name: (count, getters) for name, count, getters in READ}
        self.assertEqual(len(told), 5 * len(names))
        for name, getter, changed, errors in told:
            count, getters = wanted.get(name, (0, ()))
            with self.subTest(name=hex(name), getter=getter):
                right = getter in getters
                self.assertEqual(changed, [right and i < count for i in range(40)])
                self.assertEqual(errors, [] if right else [0x103 if name in wanted else 0x102 if name in LEFT_OUT else 0x100])

    def test_the_gimbal_is_continuous_in_range_and_the_transforms_own(self):
        told, _ = self.tell(MOTION, options=["--hand", self.file("hand.toml", WAY)])
        self.assertEqual(told.pop(), [])
        before, fastest, at_end = None, 0, [0, 0, 0]
        for frame in told:
            j, g, t = frame["joints"], frame["gimbal"], frame["transform"]
            for i in range(3):
                self.assertLessEqual(abs(g[i]), MOST_RAD[i])
                at_end[i] += abs(g[i]) > MOST_RAD[i] - 1e-6
                fastest = max(fastest, abs(g[i] - before[i]) if before else 0)
            before = g
            chain = product(about("y", -j[0]), about("x", -j[2]), about("y", g[0]), about("x", -g[1]), about("z", -g[2]))
            for row in range(3):
                for column in range(3):
                    self.assertAlmostEqual(chain[row][column], t[4 * column + row], 9)
            for i, scale in enumerate((0.024, -0.024, 0.024)):
                self.assertLessEqual(abs(frame["encoders"][i] * scale - math.degrees(j[i])), 0.0121)
            for i in range(3):
                self.assertLessEqual(abs((frame["encoders"][3 + i] - 2048) * 0.0735 - math.degrees(g[i])), 0.0368)
        self.assertLess(fastest, 0.0181)  # 18 rad/s
        self.assertGreater(fastest, 0.004)  # the hand turns it
        self.assertGreater(at_end[1], 100)  # and leads it to its stops
        # in the middle of the workspace an upright stylus is in reach
        self.assertLess(math.dist(told[-1]["transform"][8:11], [0, 1, 0]), 1e-4)

    def test_motors_warm_up_by_their_work_and_cool_down(self):
        told, report = self.tell(HEAT, options=["--hand", self.file("hand.toml", "unit_mm = 1.0\nstart_mm = [0, 0, 0]\n[[step]]\nhold = 60\n")])
        hot = told["temperatures"]
        self.assertEqual(hot[0], [0, 0, 0])
        for i in (900, 1900, 2500):  # 0.7 N is less than the 0.88 N of all the time, 3 N is more
            self.assertGreater(max(hot[i]), max(hot[i - 400]))
        self.assertLess(max(hot[1999]), 0.2)
        self.assertEqual(max(hot[3499]), 1)
        self.assertLess(hot[3499][0], 0.05)  # a force along z loads no turret
        self.assertLess(max(hot[-1]), 0.7)
        (at, code), = told["errors"]
        self.assertEqual((code, max(hot[at])), (0x200, 1))  # warm motors, once
        self.assertIn(("warm", 1), [(one["what"], one["count"]) for one in report["notes"]])


unittest.main(verbosity=1, argv=["touch_test.py"])
