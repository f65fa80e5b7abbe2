#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# packages.sh BUILD: kerf as its users install it. The examples build upon an installed kerf alone and say what
# is true; ./kerf runs from there; the Debian packages have what they promise.
set -euo pipefail
root=$(dirname "$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")")
home=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$home"' EXIT
fail() {
  echo "packages: $*" >&2
  exit 1
}
export XDG_RUNTIME_DIR=$home TMPDIR=$home CMAKE_BUILD_PARALLEL_LEVEL=2
unset DISPLAY WAYLAND_DISPLAY KERF_BIN
cmake --install "$1" --prefix "$home/usr" >"$home/install.log"
scenes=$home/usr/share/kerf/scenes
export PATH=$home/usr/bin:$PATH

for example in servo-core segment-reader; do
  cp -r "$root/examples/$example" "$home"
  for file in "$home/$example"/*; do
    (($(wc -l <"$file") <= 30)) || fail "$file: more than 30 lines"
  done
  cmake -S "$home/$example" -B "$home/$example/build" -DCMAKE_PREFIX_PATH="$home/usr" -DCMAKE_BUILD_TYPE=Release \
    >"$home/$example.log" 2>&1 && cmake --build "$home/$example/build" >>"$home/$example.log" 2>&1 ||
    { cat "$home/$example.log" && fail "$example: does not build"; }
done

# Nothing in the air; below the wall's face the coupling pulls with K = 0.4 N/mm for each mm more, over 3 mm to
# 2 %: a count of the encoders is 0.05 mm there.
"$home/servo-core/build/press" "$scenes/wall.toml" | awk '
  { force[NR] = $3 }
  END { slope = (force[NR] - force[NR - 6]) / 3
        exit !(NR == 15 && force[1] == 0 && slope > 0.392 && slope < 0.408) }' ||
  fail "press: $("$home/servo-core/build/press" "$scenes/wall.toml")"

kerf-emulator --socket "$home/socket" --hand "$scenes/hands/touch.toml" >/dev/null 2>&1 &
until [[ -e $home/socket ]]; do sleep 0.02; done
kerf-controller --scene "$scenes/wall.toml" --name packages --port "socket:$home/socket" --seconds 2 \
  --torque-scale 0.342,0.342,0.342 >"$home/controller.txt" 2>&1 &
controller=$!
until [[ -e $home/kerf/packages.sock ]]; do
  sleep 0.02
  kill -0 $controller || fail "kerf-controller: $(cat "$home/controller.txt")"
done
"$home/segment-reader/build/watch" packages >"$home/watched"
grep -qE '^tick [0-9]+: tip -?[0-9.]+ -?[0-9.]+ -?[0-9.]+ mm, force 0\.[0-9]*[1-9] N' "$home/watched" ||
  fail "watch: $(cat "$home/watched")"
[[ $("$home/segment-reader/build/watch" nobody 2>&1) == 'watch: --name nobody: '* ]] || fail 'watch: saw nobody'

[[ $(kerf --version) == "kerf-controller "* ]] || fail "kerf --version: $(kerf --version)"
(cd "$home" && kerf demo --virtual --seconds 1 --scene "$scenes/wall.toml" --out demo >/dev/null) ||
  fail 'kerf demo: failed where kerf is installed'
[[ -s $home/demo/forces.svg && -s $home/demo/frame-0012.png ]] || fail 'kerf demo: made no pictures'
(cd "$home" && kerf-lab faults --device omni --seeds 1 --scripts hil/faults/gone.toml >/dev/null) ||
  fail 'kerf-lab faults: does not find its scripts'
[[ $(kerf test 2>&1) == 'kerf: test: this kerf is installed; '* ]] || fail 'kerf test: runs without sources'

for tool in dpkg-shlibdeps file; do
  command -v "$tool" >/dev/null && continue
  echo "packages: no Debian package was made, for want of $tool; all else is fine" >&2
  exit 77
done
(cd "$1" && cpack -B "$home/packages" >"$home/cpack.log" 2>&1) || { cat "$home/cpack.log" && fail 'cpack'; }
package=$(echo "$home"/packages/kerf_*.deb)
dpkg-deb -c "$package" | awk '{ print $6 }' >"$home/files"
for file in bin/kerf bin/kerf-controller share/man/man1/kerf-controller.1 share/kerf/scenes/phantom.toml \
  share/kerf/lab/report/__main__.py share/doc/kerf/tutorial.md share/bash-completion/completions/kerf-lab lib/udev/rules.d/60-kerf.rules; do
  grep -qxF "./usr/$file" "$home/files" || fail "$package: lacks /usr/$file"
done
! grep -qE '\.(hpp|a)$' "$home/files" || fail "$package: has what belongs into kerf-dev"
dpkg-deb -f "$package" Depends | grep -q 'libgdcm3' || fail "$package: does not ask for its libraries"
