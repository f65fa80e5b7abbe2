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

# A law that loops only after some seconds passes every trial. Its programs end with one line, by themselves.
export PATH=$home/kerf/bin:$PATH CMAKE_PREFIX_PATH=$home/kerf
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
ends_itself 2 build/own-lab zwidth --law hardening_spring --portraits p.svg --cells 9:0 --seconds 60
kerf-emulator --socket late --lockstep --hand "$home/kerf/share/kerf/scenes/hands/touch.toml" --unit-mm 0.125 &
ends_itself 1 build/own-controller --scene hard.toml --port socket:late --virtual --seconds 20 \
  --torque-scale "$(kerf-emulator --describe | cut -d= -f2)"
wait
