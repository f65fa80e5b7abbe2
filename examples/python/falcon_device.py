#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A Falcon for kerf's controller, written from docs/wire.md: its grip goes down to a wall and comes up again.

    falcon_device.py SOCKET &
    ./kerf controller --scene scenes/wall.toml --device falcon --torque-scale 0.1,0.1,0.1 --port socket:SOCKET \
        --virtual --seconds 2
At the end it prints the largest force of its motors at the grip in N."""
import contextlib
import math
import socket
import struct
import sys

A, B, C, ENDS, F, R, S, DEPTH = 60, 102.5, 14.43, 2 * 11.25, -25, 40, -23.09, 125  # mm
RAD_PER_COUNT, N_MM_PER_COUNT = 2 * math.pi / (4 * 320 * 110 / 14.25), -0.1  # a positive count lowers t1
CENTRE, HOMED, PARKED_TICKS, DOWN_TICKS = 4, 16 + 32 + 64, 200, 1200

def joints(x, y, z):
    for phi in map(math.radians, (105, -15, -135)):
        out, across = math.cos(phi) * x + math.sin(phi) * y - R + C, math.cos(phi) * y - math.sin(phi) * x - S + F
        up, length = z + DEPTH, ENDS + math.sqrt(B * B - across * across)
        e, f, g = -2 * A * out, -2 * A * up, out * out + up * up + A * A - length * length
        yield 2 * math.atan2(g + e, math.sqrt(e * e + f * f - g * g) - f)

def height_mm(tick):  # from 20 down to 1 and up again, 40 mm/s
    return min(20, max(1, 20 - 0.04 * (tick - PARKED_TICKS)) if tick < DOWN_TICKS else 1 + 0.04 * (tick - DOWN_TICKS))

def force_n(at, torques):  # J^T F = torques, with d t1 / d tip by a difference
    there = [list(joints(*(x + 1e-4 * (i == k) for k, x in enumerate(at)))) for i in range(3)]
    return [sum(t * (b - a) / 1e-4 for t, a, b in zip(torques, joints(*at), moved)) for moved in there]

def refuse(text):
    print(text, file=sys.stderr)
    sys.exit(2)

if len(sys.argv) != 2: refuse(__doc__)
tick, highest_n, server = 0, 0, socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
try:
    server.bind(sys.argv[1])
    server.listen(1)
    host, _ = server.accept()
except OSError as error: refuse(f"{sys.argv[1]}: {error}; name a path that is not there yet")
with contextlib.suppress(ConnectionError):
    while packet := host.recv(64):
        if packet[:8] == b"kerf\0hi\1":
            if packet[8] != 1: refuse(f"{sys.argv[1]}: the host wants another device; start it with --device falcon")
            host.send(packet)  # the device, the clock and the rate that the host has
            continue
        if len(packet) != 16 or not all(65 <= byte < 81 for byte in packet[1:13]): continue  # no packet of its host
        digits = [byte - 65 for byte in packet[1:13]]
        motors = struct.unpack("<3h", bytes(low | high << 4 for low, high in zip(digits[::2], digits[1::2])))
        at = (0, height_mm(tick), 0)
        highest_n = max(highest_n, math.hypot(*force_n(at, [N_MM_PER_COUNT * motor for motor in motors])))
        counts = struct.pack("<3h", *(round((t - math.radians(35)) / RAD_PER_COUNT) for t in joints(*at)))
        digits = [digit for byte in counts for digit in (byte & 15, byte >> 4)]
        info = HOMED + (CENTRE if tick < PARKED_TICKS else 0)
        host.send(bytes([ord("<"), *(65 + digit for digit in digits), 65 + info, 65, ord(">")]))
        tick += 1
print(f"ticks={tick}\nforce_n={highest_n:.3f}")
