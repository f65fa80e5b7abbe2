#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The Python examples on a real log, a sweep and a K-B map: each draws a picture that is not empty.
#     python_test.sh BIN-FOLDER REPOSITORY
# Exit code 77: skipped, for want of numpy or matplotlib.
set -euo pipefail
bin=$1 root=$2
for python in python3 /usr/bin/python3 ''; do
  if [[ -n $python ]] && "$python" -c 'import numpy, matplotlib' 2>/dev/null; then break; fi
done
if [[ -z $python ]]; then
  echo 'skipped: numpy or matplotlib is missing; apt-get install python3-numpy python3-matplotlib'
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export MPLBACKEND=Agg MPLCONFIGDIR=$work

# A log, as ./kerf demo --virtual makes it.
"$bin/kerf-controller" --scene "$root/scenes/touch.toml" --torque-scale 0.342,0.342,0.342 \
  --port "socket:$work/port" --seconds 1.5 --virtual --name "python-$$" >"$work/controller.txt" &
controller=$!
"$bin/kerf-recorder" --name "python-$$" --out "$work/log" >"$work/recorder.txt" &
recorder=$!
until [[ -s $work/log/ticks.npy ]]; do sleep 0.02; kill -0 $controller; done
"$bin/kerf-emulator" --front socket --socket "$work/port" --hand "$root/scenes/hands/touch.toml" \
  --lockstep >"$work/emulator.txt" &
wait $controller $recorder

# What docs/log.md says: its three lines read this log.
sed -n 's/^    //p' "$root/docs/log.md" | sed -n '/^import numpy/,/^print/p' |
  sed "s|DIR/log|$work/log|" >"$work/three.py"
grep -q '^\[.*\] N$' <("$python" "$work/three.py") || { echo "docs/log.md: its lines read nothing" && exit 1; }
"$python" - "$work/log" <<'PY'
import sys
import numpy as np
log = np.load(sys.argv[1] + "/ticks.npy", mmap_mode="r")
known = (log["phase"] >= 2)
assert 0 < known.sum() < len(log)
assert np.isnan(log["position_mm"][~known]).all() and np.isfinite(log["position_mm"][known]).all()
started = (log["flags"] & 512) != 0
assert np.isfinite(log["velocity_mm_per_s"][started]).all() and started.sum() == 1500
assert abs(log["position_mm"][known]).max() < 1000 and abs(log["velocity_mm_per_s"][started]).max() < 5000
assert (abs(log["joint_torque_n_mm"]).max(axis=1)[(log["flags"] & 4) != 0] > 0).all()
PY

"$bin/kerf-lab" sweep "$root/scenes/touch.toml" --set force.stiffness_n_per_mm=0.2,0.4 \
  --set servo.rate_hz=500,1000 --seconds 1.2 --out "$work/sweep" >"$work/sweep.txt"
if "$bin/kerf-lab" --help | grep -q '^ *zwidth '; then
  "$bin/kerf-lab" zwidth --stiffness 0.1:10:8 --damping 0:0.01:4 --loop ideal \
    --csv "$work/map.csv" >"$work/map.txt"
fi
examples=$root/examples/python
"$python" "$examples/spectrum.py" "$work/log" "$work/spectrum.png"
"$python" "$examples/phase_portrait.py" "$work/log" "$work/portrait.png"
"$python" "$examples/kb_map.py" "$work/sweep/sweep.csv" "$work/sweep.png" \
  servo.rate_hz force.stiffness_n_per_mm peak_force_n
if [[ -e $work/map.csv ]]; then
  "$python" "$examples/kb_map.py" "$work/map.csv" "$work/map.png" loop=ideal
fi
# While it runs, in real time.
"$bin/kerf-emulator" --socket "$work/live" --hand "$root/scenes/hands/touch.toml" >"$work/live.txt" &
"$bin/kerf-controller" --scene "$root/scenes/touch.toml" --torque-scale 0.342,0.342,0.342 --port "socket:$work/live" \
  --seconds 60 --name "live-$$" >"$work/live-controller.txt" 2>&1 &
live=$!
until "$python" "$examples/live_plot.py" "live-$$" 3 "$work/live.png" 2>"$work/live-plot.txt"; do
  sleep 0.1
  kill -0 $live
done
kill $live
wait $live || true
"$python" - "$work"/*.png <<'PY'
import sys
import matplotlib.image
for name in sys.argv[1:]:
    picture = matplotlib.image.imread(name)[..., :3]
    drawn = (picture.max(axis=2) - picture.min(axis=2) > 0.2).mean()  # coloured: data, not axes
    assert drawn > 0.002, f"{name}: {drawn:.4f} of it is drawn"
PY

# A log in which nothing is felt, and one in which the device was never in hand. Then what is no log and no table.
cp -r "$work/log" "$work/free"
cp -r "$work/log" "$work/idle"
cp -r "$work/log" "$work/cut"
cp -r "$work/log" "$work/empty"
PYTHONPATH=$root/python "$python" - "$work" <<'PY'
import sys
import numpy as np
from kerf_reader.rows import crc32c
for name in ("free", "idle"):
    path = f"{sys.argv[1]}/{name}/ticks.npy"
    with open(path, "rb") as log:
        header = log.read(4096)  # np.save writes another one
    rows = np.load(path)
    rows["commanded_force_n"] = 0
    if name == "idle":
        rows["velocity_mm_per_s"] = np.nan
    rows["crc32c"] = crc32c(rows, 8)
    with open(path, "wb") as log:
        log.write(header + rows.tobytes())
PY
truncate -s -100 "$work/cut/ticks.npy"
: >"$work/empty/ticks.npy"
"$python" "$examples/phase_portrait.py" "$work/free" "$work/free.png"
refused() {  # WORDS EXAMPLE ARGUMENT...: one line that has these words, or the usage
  local words=$1 said code=0
  said=$("$python" "$examples/$2.py" "${@:3}" 2>&1) || code=$?
  [[ $code == 2 && $said == *"$words"* && $said != *Traceback* ]] ||
    { echo "$2 ${*:3}: exit code $code: $said" && exit 1; }
  [[ $# == 2 || $said != *$'\n'* ]] || { echo "$2 ${*:3}: lines: $said" && exit 1; }
}
for example in phase_portrait spectrum; do
  refused 'PICTURE.png' "$example"
  refused 'nowhere/ticks.npy: No such file' "$example" "$work/nowhere" "$work/none.png"
  refused 'empty/ticks.npy: is empty' "$example" "$work/empty" "$work/none.png"
  refused 'or the file was cut' "$example" "$work/cut" "$work/none.png"
  refused 'nowhere/none.png' "$example" "$work/log" "$work/nowhere/none.png"
done
refused 'never in hand' phase_portrait "$work/idle" "$work/none.png"
refused 'no force was sent' spectrum "$work/free" "$work/none.png"
refused 'no axis' phase_portrait "$work/log" "$work/none.png" 3
refused 'PICTURE.png' live_plot
refused 'nobody' live_plot nobody 1 "$work/none.png"
refused 'TABLE.csv' kb_map
refused 'nowhere.csv' kb_map "$work/nowhere.csv" "$work/none.png"
refused 'no column' kb_map "$work/sweep/sweep.csv" "$work/none.png" a b c
refused 'several rows for one cell; keep those of one force.stiffness_n_per_mm' kb_map "$work/sweep/sweep.csv" "$work/none.png" servo.rate_hz exit peak_force_n
if [[ -e $work/map.csv ]]; then
  "$bin/kerf-lab" zwidth --stiffness 0.1:10:3 --damping 0:0.01:2 --loop ideal,kerf --csv "$work/both.csv" >"$work/map.txt"
  refused 'keep those of one loop, such as loop=' kb_map "$work/both.csv" "$work/none.png"
fi
refused 'not three columns' kb_map "$work/sweep/sweep.csv" "$work/none.png" servo.rate_hz
refused 'no rows of these' kb_map "$work/sweep/sweep.csv" "$work/none.png" servo.rate_hz force.stiffness_n_per_mm \
  peak_force_n servo.rate_hz=3
for example in "$examples"/*.py; do
  most=30
  [[ $example == */@(omni_host|falcon_device).py ]] && most=62
  (($(wc -l <"$example") < most)) || { echo "$example: $most lines or more" && exit 1; }
done

# A host and a device that were written from docs/wire.md: each has the tip and the force that its partner has.
"$bin/kerf-emulator" --lockstep --socket "$work/omni" --hand "$root/scenes/hands/touch.toml" --report "$work/omni.json" >/dev/null &
until [[ -S $work/omni ]]; do sleep 0.02; done
"$python" "$examples/omni_host.py" "$work/omni" 4000 >"$work/omni.txt"
wait $!
"$python" "$examples/falcon_device.py" "$work/falcon" >"$work/falcon.txt" &
until [[ -S $work/falcon ]]; do sleep 0.02; done
"$bin/kerf-controller" --scene "$root/scenes/wall.toml" --device falcon --torque-scale 0.1,0.1,0.1 --virtual --seconds 2 \
  --port "socket:$work/falcon" --name "python-$$" --report "$work/falcon.json" >/dev/null
wait
"$python" - "$work" <<'PY'
import json
import sys
def told(name):
    lines = dict(line.split("=") for line in open(f"{sys.argv[1]}/{name}.txt").read().split())
    return {key: [float(one) for one in value.split(",")] for key, value in lines.items()}
host, omni = told("omni"), json.load(open(f"{sys.argv[1]}/omni.json"))
device, falcon = told("falcon"), json.load(open(f"{sys.argv[1]}/falcon.json"))
assert max(abs(a - b) for a, b in zip(host["tip_mm"], omni["final_tip_mm"])) < 0.06, (host, omni)  # a count of each joint
assert 0.2 < host["force_n"][0] < 1 and abs(host["force_n"][0] - omni["peak_motor_force_n"]) < 0.01, (host, omni)
assert falcon["end"] == "finished" and falcon["fault_count"] == falcon["stale_ticks"] == 0, falcon
assert falcon["peak_force_n"] > 0.3 and abs(device["force_n"][0] - falcon["peak_force_n"]) < 0.01, (device, falcon)
PY
for example in omni_host falcon_device; do
  refused 'SOCKET' "$example"
  refused "$work/nowhere/socket: " "$example" "$work/nowhere/socket" $([[ $example == falcon* ]] || echo 1)
done
"$bin/kerf-emulator" --personality falcon --lockstep --socket "$work/another" >/dev/null 2>&1 &
until [[ -S $work/another ]]; do sleep 0.02; done
"$bin/kerf-controller" --scene "$root/scenes/wall.toml" --port "socket:$work/other" --virtual --seconds 1 --name "python-$$" \
  >/dev/null 2>&1 &
refused 'the host wants another device' falcon_device "$work/other"
refused 'not an Omni in lock-step' omni_host "$work/another" 1
