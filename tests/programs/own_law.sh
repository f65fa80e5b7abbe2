#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# own_law.sh BUILD: installs a build into a new prefix and follows docs/own-law.md to the letter, as a new user
# would, in an empty folder. The page's blocks that name a file are that file, and equal examples/own-law.
set -euo pipefail
root=$(dirname "$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")")
home=$(mktemp -d)
trap 'rm -rf "$home"' EXIT
mkdir "$home/law"
cd "$home/law"

awk '
  /^```[a-z]+ [A-Za-z_.]+$/ { file = $2; next }
  /^```sh$/ { file = "../steps.sh"; next }
  /^```/ { file = ""; next }
  file != "" { print >file }
' "$root/docs/own-law.md"
diff -r . "$root/examples/own-law" || {
  echo "own_law: docs/own-law.md and examples/own-law differ (above); make them the same" >&2
  exit 1
}
lines=$(cat ./* | wc -l)
((lines <= 100)) || { echo "own_law: the example has $lines lines; 100 are promised" >&2; exit 1; }

cmake --install "$1" --prefix "$home/kerf" >"$home/install.log"
HOME=$home CMAKE_BUILD_PARALLEL_LEVEL=2 bash -euo pipefail "$home/steps.sh"

# The run of the page, with one law more of each kind: as it was, and as it would have been with another one.
export PATH=$home/kerf/bin:$PATH CMAKE_PREFIX_PATH=$home/kerf
cp "$root/tests/programs/laws/others.cpp" .
sed -i 's/SOURCES hardening_spring.cpp/& others.cpp/' CMakeLists.txt
cmake --build build --parallel 2 >"$home/build.log" || { cat "$home/build.log" >&2 && exit 1; }
complain() {
  echo "own_law: $*" >&2
  exit 1
}
replays() {  # replays WORD PROGRAM OPTION...
  local said
  said=$("${@:2}" 2>&1) || [[ $said == kerf-replay:* ]] || complain "${*:2}: $said"
  [[ $said == *"$1"* ]] || complain "${*:2}: says nothing of \"$1\": $said"
}
replays 'each equal to the last bit' build/own-replay hard/log
KERF_BIN=build/own replays 'each equal to the last bit' kerf replay hard/log
replays 'N, 0.0000 mm between the places' build/own-replay hard/log --law half_spring
replays 'pose: velocity_mm_per_s' build/own-replay hard/log --estimator standing_hand
replays '0.0000 N' build/own-replay hard/log --stabiliser no_force
replays '--law half_spin is unknown; did you mean "half_spring"? known: half_spring, hardening_spring; none: "coupling"' \
  build/own-replay hard/log --law half_spin
replays 'is unknown; known: difference, foaw, standing_hand' build/own-replay hard/log --estimator x
replays 'is unknown; known: energy_bounding, no_force, passivity; none: "none"' build/own-replay hard/log --stabiliser x
replays 'is unknown: this program has no force law; yours is in the programs built with it (docs/own-law.md)' kerf-replay hard/log
# A run that has another one of each kind; and one without, whose scene sets the coupling.
KERF_BIN=build/own kerf demo --scene hard.toml --set force.law.hardening_n_per_mm3=0.02 --set servo.velocity=standing_hand \
  --set force.stabiliser=no_force --headless --virtual --seconds 1 --out three >"$home/demo.log" || complain "$(cat "$home/demo.log")"
replays 'each equal to the last bit' build/own-replay three/log
replays 'N, 0.0000 mm between the places' build/own-replay three/log --law half_spring --stabiliser none
kerf demo --scene touch --headless --virtual --seconds 4 --out touched >"$home/demo.log" || complain "$(cat "$home/demo.log")"
replays 'between the places' build/own-replay touched/log --law half_spring --out asked
replays 'each equal to the last bit' build/own-replay asked

# A law that crashes is told before the first tick.
cp hardening_spring.cpp "$home" && sed -i 's|const Real d = norm.*|&\n    if (d != Real(0)) __builtin_trap();|' hardening_spring.cpp
cmake --build build --target own-replay >"$home/build.log" || { cat "$home/build.log" >&2 && exit 1; }
replays 'force law hardening_spring ended the program by signal' build/own-replay touched/log --law hardening_spring --out none
[[ ! -e none ]] || complain 'a replay that was refused leaves its --out'
cp "$home/hardening_spring.cpp" .

# A law that loops only after some seconds passes every trial. Its programs end with one line, by themselves.
sed -i -e 's|struct State {};.*|struct State { int steps = 0; };|' \
  -e 's|State&) const noexcept {|State\& state) const noexcept {\n    if (++state.steps > 2500) for (volatile int i = 0; i == 0;) {}|' \
  hardening_spring.cpp
cmake --build build >"$home/build.log"
ends_itself() {  # ends_itself CODE COMMAND...
  local code=0
  # By its own time: on a busy machine five seconds of it are minutes.
  (ulimit -t 120 && exec "${@:2}") >"$home/out" 2>"$home/err" || code=$?
  { ((code == $1)) && grep -q 'did not end in 5 s' "$home/err"; } || {
    echo "own_law: a law that loops: exit code $code and not $1:" "${@:2}" >&2
    cat "$home/err" >&2
    exit 1
  }
}
ends_itself 2 build/own-lab zwidth --law hardening_spring --damping 0,0.01 --stiffness 0.05:9:5
ends_itself 2 build/own-replay touched/log --law hardening_spring
ends_itself 2 build/own-lab zwidth --law hardening_spring --portraits p.svg --cells 9:0 --seconds 60
kerf-emulator --socket late --lockstep --hand "$home/kerf/share/kerf/scenes/hands/touch.toml" --unit-mm 0.125 &
ends_itself 1 build/own-controller --scene hard.toml --port socket:late --virtual --seconds 20 \
  --torque-scale "$(kerf-emulator --describe | cut -d= -f2)"
wait
