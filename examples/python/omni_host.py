#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A host for kerf's emulated Omni, written from docs/wire.md: a table that pushes the hand upwards.

    ./kerf emulator --lockstep --socket SOCKET --hand scenes/hands/touch.toml &
    omni_host.py SOCKET TICKS
At the end it prints the tip in mm and the largest force in N."""
import math
import socket
import struct
import sys

HELLO = struct.pack("<8s2B2xI4x", b"kerf\0hi\1", 0, 1, 1000)  # Omni, lock-step, 1000 Hz
DOCK, SIGN, RAD_PER_COUNT = (0, 0.23, -0.37), (1, -1, 1), 2 * math.pi / 15000
TOP_MM, WIDE_MM, N_PER_MM, N_MM_PER_COUNT = 0.5, 20, 0.4, 0.342  # ./kerf emulator --describe has the last one
REST_TICKS, MOTORS_ON, STEADY_LIGHT = 50, 8, 3
OFF = struct.pack("<4H8x", 0x7FF, 0x7FF, 0x7FF, 0x53C0)

def refuse(text):
    print(text, file=sys.stderr)
    sys.exit(2)

if len(sys.argv) != 3 or not sys.argv[2].isdecimal() or int(sys.argv[2]) < 1: refuse(__doc__)
try:
    link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    link.connect(sys.argv[1])
    link.send(HELLO)
    answer = next(packet for packet in iter(lambda: link.recv(64), b"") if packet[:8] == HELLO[:8])
    if answer != HELLO:
        refuse(f"{sys.argv[1]}: not an Omni in lock-step at 1000 Hz; start kerf-emulator as above")
    rest, zero, highest_n = 0, None, 0
    for tick in range(int(sys.argv[2])):
        report = link.recv(64)  # the first one comes unasked
        counts, undocked = struct.unpack_from("<3h", report, 4), report[19] & 4
        rest = 0 if undocked else rest + 1
        if rest >= REST_TICKS:
            zero = counts  # at rest in the inkwell: calibrated
        moved = [((c - z + 0x8000) % 0x10000 - 0x8000) for c, z in zip(counts, zero or counts)]  # they wrap at 16 bits
        q1, q2, q3 = (dock + sign * RAD_PER_COUNT * n for dock, sign, n in zip(DOCK, SIGN, moved))
        reach = 133.35 * (math.cos(q2) + math.sin(q3))
        tip = (-math.sin(q1) * reach, 133.35 * (math.sin(q2) - math.cos(q3)) + 23.35, math.cos(q1) * reach - 168.35)
        above = undocked and zero and abs(tip[2]) < WIDE_MM
        up_n = N_PER_MM * min(max(0, TOP_MM - tip[1]), WIDE_MM / 4) if above else 0
        torques = (0, 133.35 * math.cos(q2) * up_n, 133.35 * math.sin(q3) * up_n)  # the row of J for y
        words = (0x7FF + round(torque / N_MM_PER_COUNT) for torque in torques)
        status = 0x53C0 | (STEADY_LIGHT if zero else 0) | (MOTORS_ON if up_n else 0)
        link.send(struct.pack("<4H8x", *words, status))
        highest_n = max(highest_n, up_n)
    link.send(OFF)
    print(f"tip_mm={tip[0]:.3f},{tip[1]:.3f},{tip[2]:.3f}\nforce_n={highest_n:.3f}")
except (OSError, StopIteration, IndexError, struct.error) as error:
    refuse(f"{sys.argv[1]}: {error or 'the link ended'}; is kerf-emulator there, and has it a hand?")
