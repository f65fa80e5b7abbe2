#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""reader_test.py ROOT BIN: kerf_reader installed by the lines of docs/compatibility.md, without a network, then against a real run: the same
rows from segment and log, the same voxels as in the controller's own file, one line for what is not there.

Exit code 77: skipped, for want of numpy, setuptools, venv or wheel."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

root, programs = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
try:
    import numpy as np
    import ensurepip, setuptools, wheel  # noqa: F401, E401
except ImportError as lack:
    if sys.executable != "/usr/bin/python3" and os.path.exists("/usr/bin/python3"):  # Debian's own has them
        os.execv("/usr/bin/python3", ["/usr/bin/python3", *sys.argv])
    print(f"skipped: {lack}; apt-get install python3-numpy python3-setuptools python3-venv python3-wheel")
    sys.exit(77)

home = tempfile.TemporaryDirectory()
os.chdir(home.name)
os.environ["XDG_RUNTIME_DIR"] = home.name
subprocess.run(["cp", "-r", root / "python", "python"], check=True)
# The page's own lines, where no network answers.
page = (root / "docs" / "compatibility.md").read_text(encoding="utf-8")
install = re.search(r"\n    (python3 -m venv .*)\n    (venv/bin/pip .*)\n", page)
environment = {name: value for name, value in os.environ.items() if not name.startswith("PIP_")}
environment.update(PATH=f"{os.path.dirname(sys.executable)}:{os.environ['PATH']}", PIP_CONFIG_FILE=os.devnull, HOME=home.name,
                   https_proxy="http://127.0.0.1:9", http_proxy="http://127.0.0.1:9")
for line in install.groups():
    done = subprocess.run(["bash", "-c", line], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert done.returncode == 0, f"docs/compatibility.md: {line}: {done.stdout}"
sys.path[:0] = map(str, pathlib.Path("venv").resolve().glob("lib/python3*/site-packages"))
import kerf_reader  # noqa: E402
from kerf_reader import Log, Segment, SegmentError, layout  # noqa: E402


def refused(what, kind, words):
    try:
        what()
    except kind as error:
        assert all(word in str(error) for word in words) and "\n" not in str(error), error
        return
    assert False, f"nothing was refused: {words}"


assert kerf_reader.__file__.startswith(home.name)
began = time.time()
quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
emulator = subprocess.Popen([programs / "kerf-emulator", "--socket", "socket", "--hand", root / "scenes/hands/touch.toml"], **quiet)
recorder = subprocess.Popen([programs / "kerf-recorder", "--wait", "300", "--name", "reader", "--out", "log"], **quiet)
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
refused(lambda: Segment("nobody"), SegmentError, ["nobody.sock", "with this name first, or take a name that runs: reader"])
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

at = log.utc[0].astype("i8") / 1e9
assert began <= at <= time.time(), (began, at)
assert (np.diff(log.utc) / np.timedelta64(1, "ns") == np.diff(log["start_ns"].astype("i8"))).all()

header, _, data = pathlib.Path("final.nrrd").read_bytes().partition(b"\n\n")
if b"encoding: gz" in header:
    import gzip
    data = gzip.decompress(data)
density = segment.density()
assert density.tobytes() == data, "the voxels differ from the controller's own file"
assert segment.labels() is None and density.max() == 65535 and density.min() == 0

refused(lambda: Segment("nobody"), SegmentError, ["nobody.sock", "start kerf-controller with this name first"])
refused(lambda: Segment("../x"), SegmentError, ["no name of a controller"])
refused(lambda: Log("nowhere"), ValueError, ["nowhere", "give the folder"])

# In a locale of another encoding: kerf's files are UTF-8 in each.
of_log = pathlib.Path("log/scene.json").read_bytes()
pathlib.Path("log/scene.json").write_text('{"title": "Zahn \u00e4"}', encoding="utf-8")
done = subprocess.run([sys.executable, "-c", "import sys; sys.path[:0] = sys.argv[1:]; import kerf_reader\n"
                       "print(ascii(kerf_reader.Log('log', check=False).scene['title']))", *sys.path], capture_output=True, text=True,
                      env={**os.environ, "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"})
assert done.stdout == "'Zahn \\xe4'\n", done.stderr
pathlib.Path("log/scene.json").write_bytes(of_log)

os.mkdir("empty")
refused(lambda: Log("empty"), ValueError, ["empty/ticks.npy: No such file", "give the folder"])
whole = pathlib.Path("log/ticks.npy").read_bytes()
pathlib.Path("log/manifest.json").rename("kept.json")
refused(lambda: Log("."), ValueError, ["ticks.npy: No such file", "; give log"])
for text, why in (("{", "no JSON"), ("3", "no table"), ("[]", "no table"), ("{}", "tick_ns"), ('{"tick_ns": "1"}', "tick_ns"),
                  ('{"tick_ns": 0}', "tick_ns"), ('{"tick_ns": true}', "tick_ns")):
    pathlib.Path("log/manifest.json").write_text(text)
    refused(lambda: Log("log"), ValueError, ["log/manifest.json: " + why])
for foreign in (np.zeros(3), np.zeros(3, [("tick", "<u8")]), np.zeros((2, 2), layout.TICK)):
    np.save("log/ticks.npy", foreign)
    refused(lambda: Log("log"), ValueError, ["log/ticks.npy: no ticks of this version", "give the folder"])
np.savez("log/ticks.npz", foreign)
pathlib.Path("log/ticks.npz").rename("log/ticks.npy")
refused(lambda: Log("log"), ValueError, ["log/ticks.npy: ", "bytes are no table of NumPy"])
for length in (0, 5, 100, 5000, len(whole) - 1):
    pathlib.Path("log/ticks.npy").write_bytes(whole[:length])
    refused(lambda: Log("log"), ValueError, ["log/ticks.npy: ", "cut" if length else "is empty", "give the folder"])
print(f"reader: {len(seen)} rows, {density.size} voxels")
