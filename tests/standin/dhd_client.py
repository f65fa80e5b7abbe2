# SPDX-License-Identifier: Apache-2.0
"""A small haptic program on the dhd/drd interface, by ctypes: it knows libdrd.so.3 by its names alone and nothing of kerf.

    python3 dhd_client.py WHAT COUNT OUT.json

WHAT: spring, a closed loop towards the origin of COUNT force commands; move, a motion under drd's regulation; or a kind of
misuse. OUT.json gets what the program itself measured."""
import ctypes
import json
import math
import os
import sys
import time

STIFFNESS_N_PER_M = 60.0
MOST_N = 3.0
REST = 1500  # force commands of zero at the end, in which the hand comes to rest

dhd = ctypes.CDLL("libdrd.so.3")
dhd.dhdErrorGetLastStr.restype = dhd.dhdGetSystemName.restype = ctypes.c_char_p
dhd.dhdSetForce.argtypes = [ctypes.c_double] * 3 + [ctypes.c_byte]
dhd.drdMoveToPos.argtypes = [ctypes.c_double] * 3 + [ctypes.c_bool, ctypes.c_byte]
dhd.drdIsInitialized.restype = ctypes.c_bool
dhd.dhdSleep.argtypes = [ctypes.c_double]
dhd.dhdGetTime.restype = ctypes.c_double
ANY = ctypes.c_byte(-1)


def read(function):
    out = [ctypes.c_double() for _ in range(3)]
    code = function(*map(ctypes.byref, out), ANY)
    if code < 0:
        sys.exit(f"{function.__name__}: {dhd.dhdErrorGetLastStr().decode()}")
    return [one.value for one in out]


def spring(count, what):
    positions, forces, mask = [], [], 0
    for left in range(count, 0, -1):
        position = read(dhd.dhdGetPosition)
        pull = [-STIFFNESS_N_PER_M * x for x in position]
        force = [f * min(1, MOST_N / max(math.hypot(*pull), 1e-9)) for f in pull]
        if left <= REST and what == "spring":
            force = [0.0, 0.0, 0.0]
        if what == "nan" and left == 10:
            force = [math.nan, 0.0, 0.0]
        if what == "pause" and left == 10:
            time.sleep(0.3)
        if what == "wrong_id" and left == 10:
            dhd.dhdSetForce(0, 0, 0, 7)
        code = dhd.dhdSetForce(*force, -1)
        if code < 0 and what != "nan":
            sys.exit("dhdSetForce: " + dhd.dhdErrorGetLastStr().decode())
        mask |= dhd.dhdGetButtonMask(ANY)
        positions.append(position)
        forces.append(force)
    lengths = [math.hypot(*force) for force in forces]
    steps = zip(forces, positions, positions[1:])
    return {"peak_n": max(lengths), "rms_n": math.sqrt(sum(f * f for f in lengths) / len(lengths)),
            "work_mj": 1000 * sum(f * (b - a) for force, here, there in steps for f, a, b in zip(force, here, there)),
            "first_m": positions[0], "last_m": positions[-1], "buttons": mask}


def move():
    """To three points; how near it came to each."""
    if not dhd.drdIsInitialized(ANY) and dhd.drdAutoInit(ANY) < 0:
        sys.exit("drdAutoInit")
    if dhd.drdStart(ANY) < 0:
        sys.exit("drdStart: " + dhd.dhdErrorGetLastStr().decode())
    off_m = []
    for goal in ([0.02, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.02]):
        if dhd.drdMoveToPos(*goal, True, -1) < 0:
            sys.exit("drdMoveToPos: " + dhd.dhdErrorGetLastStr().decode())
        off_m.append(max(abs(a - b) for a, b in zip(goal, read(dhd.dhdGetPosition))))
    dhd.drdStop(False, ANY)
    return {"off_m": off_m}


def main():
    what, count, out = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    if dhd.dhdOpen() < 0:
        sys.exit("dhdOpen: " + dhd.dhdErrorGetLastStr().decode())
    dhd.dhdEnableForce(ctypes.c_ubyte(1), ANY)
    report = {"name": dhd.dhdGetSystemName(ANY).decode(), "type": dhd.dhdGetSystemType(ANY)}
    if what == "watchdog":  # the firmware ends a force whose program is silent
        dhd.dhdEnableExpertMode()
        dhd.dhdSetWatchdog(ctypes.c_ubyte(160), ANY)
        dhd.dhdSetForce(1, 0, 0, -1)
        dhd.dhdSleep(0.2)
        status = (ctypes.c_int * 17)()
        dhd.dhdGetStatus(status, ANY)
        report["status"] = list(status)
    else:
        report.update(move() if what == "move" else spring(count, what))
    if what == "killed":
        os.kill(os.getpid(), 9)
    if what not in ("not_cleared", "killed"):
        dhd.dhdStop(ANY)
    dhd.dhdClose(ANY)
    with open(out, "w", encoding="utf-8") as file:
        json.dump(report, file)


main()
