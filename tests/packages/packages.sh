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

# What is installed of the interface is include/kerf and what a law, which is a template, is made of.
headers=$(cd "$home/usr/include/kerf" && find . -name '*.h*' ! -path './private/*' -printf '%P\n' | sort)
[[ $headers == $(cd "$root" && git ls-files include/kerf 2>/dev/null | sed 's|include/kerf/||' | sort) || ! -d $root/.git ]] ||
  fail "headers: $headers"
(($(find "$home/usr/include/kerf/private" -name '*.hpp' | wc -l) == 5)) || fail 'headers: more than a law needs'
for example in servo-core segment-reader external; do
  cp -r "$root/examples/$example" "$home"
  for file in "$home/$example"/*; do
    (($(wc -l <"$file") <= 80)) || fail "$file: more than 80 lines"
  done
  cmake -S "$home/$example" -B "$home/$example/build" -DCMAKE_PREFIX_PATH="$home/usr" -DCMAKE_BUILD_TYPE=Release \
    >"$home/$example.log" 2>&1 && cmake --build "$home/$example/build" >>"$home/$example.log" 2>&1 ||
    { cat "$home/$example.log" && fail "$example: does not build"; }
done

# Its own law, K = 0.5 N/mm: force over length of the spring in each row with contact; read from a recording that other
# programs take.
press() { "$home/servo-core/build/press" "$scenes/wall.toml" "$scenes/hands/touch.toml" "$home/pressed"; }
press >"$home/press.txt" || fail "press: $(cat "$home/press.txt")"
awk '$1 > 0.1 { met++; if ($3 / $1 < 0.499 || $3 / $1 > 0.501) bad++ } END { exit !(NR == 16 && met >= 4 && !bad) }' "$home/press.txt" ||
  fail "press: $(cat "$home/press.txt")"
kerf record check "$home/pressed" >/dev/null || fail 'press: its recording is not sound'
[[ $(press 2>&1) == "press: $home/pressed/ticks.npy: holds a recording; "* ]] || fail 'press: writes over a recording'

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

# A force of its own, by the header for C and by libkerf.
for program in floor ball; do
  [[ $("$home/external/build/$program" nobody 2>&1) == "$program: "*'no controller with a scene'* ]] || fail "$program: saw nobody"
done

[[ $(kerf --version) == "kerf "[0-9]* ]] || fail "kerf --version: $(kerf --version)"
(cd "$home" && kerf demo --virtual --seconds 1 --scene "$scenes/wall.toml" --out demo >/dev/null) ||
  fail 'kerf demo: failed where kerf is installed'
[[ -s $home/demo/forces.svg && -s $home/demo/frame-0012.png ]] || fail 'kerf demo: made no pictures'
(cd "$home" && kerf-lab faults --device omni --seeds 1 --scripts hil/faults/gone.toml >/dev/null) ||
  fail 'kerf-lab faults: does not find its scripts'
[[ ! -e $home/usr/bin/kerf-studies && ! -e $home/usr/share/kerf/lab/report/contact.py ]] || fail 'kerf-studies: is installed'
for command in test 'bench safety' 'bench bridge' 'bench ranges' studies 'demo --two-machines'; do  # whole, or nothing
  # shellcheck disable=SC2086
  [[ $(kerf $command 2>&1) == "kerf: ${command/ --/: --}: this kerf is installed; "* ]] || fail "kerf $command: runs without sources"
done
! kerf --help | grep -q '\./kerf' || fail 'kerf --help: speaks of ./kerf'
! kerf --help | grep -q 'kerf setup' || fail 'kerf --help: lists what needs a clone'
kerf --help | grep -q 'bench ranges need a clone' || fail 'kerf --help: does not say what needs a clone'
for scene in touch touch.toml scenes/touch.toml; do  # from any folder, by its name
  (cd "$home" && kerf controller --check --scene $scene 2>/dev/null) | grep -qx "scene=$scenes/touch.toml" ||
    fail "kerf controller --scene $scene: does not find it"
done
(cd "$home" && kerf demo --virtual --seconds 1 --scene touch --out touched) >"$home/said" || fail 'kerf demo --scene touch'
grep -qx "kerf: demo: --scene touch: $scenes/touch.toml" "$home/said" || fail 'kerf demo --scene touch: does not say which'
# A volume that does not come with kerf, from the user's own folder.
export XDG_DATA_HOME=$home/data
spine() { kerf controller --check --scene spine/spine.toml 2>&1; }
[[ $(spine) == *"here or as $home/data/kerf/scenes/spine/ct.nrrd"* ]] || fail "kerf: where a CT belongs: $(spine)"
mkdir -p "$home/data/kerf/scenes/spine" && kerf volume phantom --size 64x64x64 --out "$home/data/kerf/scenes/spine/ct.nrrd" >/dev/null
rm "$home/data/kerf/scenes/spine/ct-labels.nrrd"  # of a tooth's materials
[[ $(spine) == *'volume=spine '* ]] || fail "kerf: a CT in the user's folder: $(spine)"
[[ $(cd "$home" && kerf demo --fast 2>&1) == 'kerf: demo: --fast: unknown; see kerf demo --help' ]] || fail 'kerf demo: speaks of ./kerf'

for tool in dpkg-shlibdeps file; do
  command -v "$tool" >/dev/null && continue
  echo "skipped: the Debian package: no $tool; all else is fine" >&2
  exit 77
done
(cd "$1" && cpack -B "$home/packages" >"$home/cpack.log" 2>&1) || { cat "$home/cpack.log" && fail 'cpack'; }
package=$(echo "$home"/packages/kerf_*.deb)
if command -v lintian >/dev/null; then
  found=$(lintian --no-cfg --fail-on none "$home"/packages/kerf*.deb | grep '^[EW]: ' || true)
  [[ -z $found ]] || fail "lintian: $found"
else
  skipped='lintian: not there, so the packages are not checked by it; apt-get install lintian'
fi
dpkg-deb -c "$package" | awk '{ print $6 }' >"$home/files"
for file in bin/kerf bin/kerf-controller share/man/man1/kerf-controller.1.gz share/doc/kerf/copyright share/doc/kerf/changelog.gz share/kerf/scenes/phantom.toml \
  share/kerf/lab/report/__main__.py share/doc/kerf/tutorial.md share/bash-completion/completions/kerf-lab lib/udev/rules.d/60-kerf.rules \
  share/metainfo/invalid.kerf.kerf.metainfo.xml share/kerf/ros/kerf_msgs/package.xml; do
  grep -qxF "./usr/$file" "$home/files" || fail "$package: lacks /usr/$file"
done
! grep -v '^./usr/share/doc/kerf/examples/' "$home/files" | grep -qE '\.(hpp|a)$' || fail "$package: has what belongs into kerf-dev"
dpkg-deb -c "$home"/packages/kerf-dev_*.deb >"$home/files-dev"
grep -q ' ./usr/share/doc/kerf-dev/copyright$' "$home/files-dev" || fail 'kerf-dev: lacks a copyright'
for field in Maintainer Description; do
  for deb in "$home"/packages/kerf*.deb; do
    [[ -n $(dpkg-deb -f "$deb" "$field") ]] || fail "$deb: no $field"
  done
done
dpkg-deb -f "$package" Depends | grep -q 'libgdcm3' || fail "$package: does not ask for its libraries"
# It asks for no package but those of a library that one of its programs is linked with, OpenGL, which is loaded at run time, and
# the Python of the demo. What apt installs as well unless told otherwise: nothing.
mkdir -p "$home/linked/debian" && printf 'Source: kerf\n\nPackage: kerf\nArchitecture: any\n' >"$home/linked/debian/control"
linked=$(cd "$home/linked" && dpkg-shlibdeps -O "$home"/usr/bin/kerf-* 2>/dev/null | sed 's/^shlibs:Depends=//')
while read -r name; do
  [[ " libegl1 libgl1 libgl1-mesa-dri python3 " == *" $name "* || ", $linked" == *", $name"@(,*| *|) ]] ||
    fail "$package: asks for $name, which no program loads"
done < <(dpkg-deb -f "$package" Depends | tr ',' '\n' | awk '{ print $1 }')
[[ -z $(dpkg-deb -f "$package" Recommends) ]] || fail "$package: recommends $(dpkg-deb -f "$package" Recommends)"
if [[ -n ${skipped:-} ]]; then
  echo "skipped: $skipped; all else is fine" >&2
  exit 77
fi
