# SPDX-License-Identifier: Apache-2.0
"""What a program read and sent, beside the mechanics of the emulator.

    compare.py REPORT.json PRINTED.txt AXES      AXES: which axis of kerf's frame is the program's x, y and z, as zxy

Exit code 1 if a position is off by more than a count of the device, or the force by more than 2 %."""
import json
import math
import pathlib
import re
import sys

COUNT_MM = {"touch": 0.055, "omega": 0.01}
report = json.loads(pathlib.Path(sys.argv[1]).read_text())
said = re.search(r"position_mm (\S+) (\S+) (\S+) rms_n (\S+) seconds (\S+) work_mj (\S+)", pathlib.Path(sys.argv[2]).read_text())
position, (rms_n, seconds, work_mj) = [float(x) for x in said.groups()[:3]], map(float, said.groups()[3:])
truth = [report["final_tip_mm"]["xyz".index(axis)] for axis in sys.argv[3]]
off_mm = max(abs(a - b) for a, b in zip(position, truth))
force, given_mj = report["force"], report["energy"]["given_mj"]
given_n = force["given_rms_n"] * math.sqrt(report["seconds"] / seconds)  # of the whole run, which has rests
off = given_n / rms_n - 1
print(f"position off by {1000 * off_mm:.1f} um, a count is {1000 * COUNT_MM[report['device']]:.0f} um")
print(f"force: sent {rms_n:.4f} N RMS, given {given_n:.4f} N: {100 * off:+.2f} %")
print(f"work: {work_mj:.2f} mJ by the program, {given_mj:.2f} mJ by the motors: {100 * (given_mj / work_mj - 1):+.2f} %")
print("misuse:", ", ".join(one["what"] for one in report["misuse"]) or "none")
sys.exit(off_mm > COUNT_MM[report["device"]] or abs(off) > 0.02)
