#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""reader_test.py ROOT BIN: kerf_reader built and installed without a network, then against a real run: the same
rows from segment and log, the same voxels as in the controller's own file, one line for what is not there.

Exit code 77: skipped, for want of numpy or setuptools."""
import os
import pathlib
import subprocess
import sys
import tempfile
import time

root, programs = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
try:
    import numpy as np
    import setuptools  # noqa: F401
except ImportError as lack:
    if sys.executable != "/usr/bin/python3" and os.path.exists("/usr/bin/python3"):  # Debian's own has them
        os.execv("/usr/bin/python3", ["/usr/bin/python3", *sys.argv])
    print(f"reader: {lack}; apt-get install python3-numpy python3-setuptools")
    sys.exit(77)

home = tempfile.TemporaryDirectory()
os.chdir(home.name)
os.environ["XDG_RUNTIME_DIR"] = home.name
subprocess.run(["cp", "-r", root / "python", "source"], check=True)
build = [sys.executable, "-c", "import setuptools; setuptools.setup()", "-q", "build", "--build-lib", home.name + "/site"]
subprocess.run(build, cwd="source", check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
sys.path.insert(0, home.name + "/site")
import kerf_reader  # noqa: E402
from kerf_reader import Log, Segment, SegmentError, layout  # noqa: E402

assert kerf_reader.__file__.startswith(home.name)
quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
emulator = subprocess.Popen([programs / "kerf-emulator", "--socket", "socket", "--hand", root / "scenes/hands/touch.toml"], **quiet)
recorder = subprocess.Popen([programs / "kerf-recorder", "--name", "reader", "--out", "log"], **quiet)
while not os.path.exists("socket"):
    time.sleep(0.02)
controller = subprocess.Popen([programs / "kerf-controller", "--scene", root / "scenes/wall.toml", "--name", "reader", "--port",
                               "socket:socket", "--seconds", "2", "--torque-scale", "1,1,1", "--final", "final.nrrd"], **quiet)
for _ in range(500):
    try:
        segment = Segment("reader")
        break
    except SegmentError:
        assert controller.poll() is None, "kerf-controller: ended before it could be read"
        time.sleep(0.02)
seen, after = [], 0
while segment.alive:
    rows, after = segment.records(after)
    seen.append(rows)
    time.sleep(0.05)
rows, after = segment.records(after)
seen = np.concatenate([*seen, rows])
last = segment.latest()
assert controller.wait() == 0 and recorder.wait() == 0
emulator.wait()

log = Log("log")
assert log.ticks.dtype == layout.TICK, "layout.TICK is not the log's rows; bring it up to date"
assert log.manifest["abi_hash"] == f"{layout.ABI:016x}"
assert abs(log.tick_s - segment.tick_s) < 1e-12 and log.scene == segment.scene
assert last["tick"] == log["tick"][-1] and len(seen) > 2000
both, mine, of_log = np.intersect1d(seen["tick"], log["tick"], return_indices=True)
assert len(both) > 2000 and seen[mine].tobytes() == log.ticks[of_log].tobytes()
assert 1900 < log.started.sum() <= 2001 and abs(log.seconds[-1] - (len(log) - 1) * log.tick_s) < 1e-9

header, _, data = pathlib.Path("final.nrrd").read_bytes().partition(b"\n\n")
if b"encoding: gz" in header:
    import gzip
    data = gzip.decompress(data)
density = segment.density()
assert density.tobytes() == data, "the voxels differ from the controller's own file"
assert segment.labels() is None and density.max() == 65535 and density.min() == 0


def refused(what, kind, words):
    try:
        what()
    except kind as error:
        assert all(word in str(error) for word in words) and "\n" not in str(error), error
        return
    assert False, f"nothing was refused: {words}"


refused(lambda: Segment("nobody"), SegmentError, ["nobody.sock", "start kerf-controller"])
refused(lambda: Segment("../x"), SegmentError, ["no name of a controller"])
refused(lambda: Log("nowhere"), ValueError, ["nowhere", "give the folder"])
os.mkdir("empty")
refused(lambda: Log("empty"), ValueError, ["empty/ticks.npy: No such file", "give the folder"])
whole = pathlib.Path("log/ticks.npy").read_bytes()
pathlib.Path("log/manifest.json").rename("manifest.json")
pathlib.Path("log/manifest.json").write_text("{")
refused(lambda: Log("log"), ValueError, ["log/manifest.json: no JSON"])
for length in (0, 5, 100, 5000, len(whole) - 1):
    pathlib.Path("log/ticks.npy").write_bytes(whole[:length])
    refused(lambda: Log("log"), ValueError, ["log/ticks.npy: ", "cut" if length else "is empty", "give the folder"])
print(f"reader: {len(seen)} rows, {density.size} voxels")
