#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# `./kerf doctor [--demo]`: what this machine offers to kerf, and what each lack costs. Installs and
# builds nothing; takes less than a second, with --demo some.
# Ends with 1 when the demo cannot run here, else with 0.
set -euo pipefail
root=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." && pwd)
bin=${KERF_BIN:-$root/build/release/bin}
impossible=0

# row ok|warn|fail WHAT FOUND [EFFECT; WAY OUT]
row() {
  if [[ $1 == fail ]]; then impossible=1; fi
  { printf '%-4s  %-13s  %s\n' "$1" "$2" "$3" &&
    if [[ -n ${4:-} ]]; then printf '%21s%s\n' '' "$4"; fi; } 2>/dev/null || {
    echo 'kerf: doctor: standard output: cannot be written; make room, or send it elsewhere' >&2
    exit 2
  }
}

missing=()
installed=''
if [[ ! -e $root/CMakeLists.txt ]]; then
  installed=1  # its package asked for what it needs
  bin=${KERF_BIN:-$(readlink -m "$root/../../bin")}
else
  mapfile -t missing < <("$root/.ci/packages.sh" --missing build)
fi
if [[ -n $installed ]]; then
  row ok kerf "$("$bin/kerf-controller" --version), installed"
elif ((${#missing[@]} == 0)); then
  row ok packages 'all that the build needs'
elif ((EUID == 0)) || command -v sudo >/dev/null; then
  row warn packages "missing: ${missing[*]}" './kerf setup installs them'
else
  row fail packages "missing: ${missing[*]}" 'not root and no sudo: ask who may install packages'
fi

if [[ -n $installed ]]; then
  true
elif command -v g++ >/dev/null; then
  row ok compiler "$(g++ --version | head -n 1)"
else
  row warn compiler none './kerf setup installs g++'
fi

cores=$(nproc)
if ((cores >= 2)); then
  row ok cores "$cores; the servo and its emulator take the last one"
else
  row warn cores 1 'pictures delay the servo: expect overruns; --virtual needs no second core'
fi

throttle=$(cat /proc/sys/kernel/sched_rt_runtime_us 2>/dev/null || echo unknown)
case $throttle in
  -1 | unknown) row ok 'rt throttling' "${throttle/-1/off}" ;;
  *) row ok 'rt throttling' "real-time threads may use $((throttle / 10000)) % of a core" \
    'one that never sleeps stops all others of its core: docs/devices.md, "50 ms in each second"' ;;
esac

# Devices, rights to them and real-time rights: the controller's own look around.
if [[ -x $bin/kerf-controller ]]; then
  while read -r kind text; do
    case $kind in
      found) row ok device "$text" ;;
      missing)
        read -r cure || cure=''
        row warn "${text%%:*}" "${text#*: }" "$cure"
        ;;
    esac
  done < <("$bin/kerf-controller" --probe 2>&1)
else
  row warn device 'not looked for' './kerf setup builds the program that looks, and asks for rights'
fi

if [[ -r /dev/fuse && -w /dev/fuse ]]; then
  row ok FUSE /dev/fuse
else
  row warn FUSE 'no access to /dev/fuse' 'device nodes cannot be emulated; the socket port can'
fi

if [[ -n $installed ]]; then
  true  # no tests
elif lack=$("$root/hil/guest/guest.sh" lacks); then
  row ok QEMU "$(qemu-system-x86_64 --version | sed -n '1s/.*version \([0-9.]*\).*/\1/p')"
else
  lack=${lack#guest: }
  row warn QEMU "${lack%%; *}" "hil_guest is skipped; ${lack#*; }"
fi

libraries=$(dpkg-query -W -f '${Package} ${Version}\n' libusb-1.0-0-dev libhidapi-dev \
  libseccomp-dev libgdcm-dev 2>/dev/null | sed -E 's/(-dev)? ([0-9]+:)?([0-9.]+).*/ \3/' |
  paste -sd ',' | sed 's/,/, /g') || true
if [[ -z $installed ]]; then row ok libraries "${libraries:-unknown: this is not Debian}"; fi

if [[ -n ${DISPLAY:-}${WAYLAND_DISPLAY:-} ]]; then
  row ok display "${WAYLAND_DISPLAY:-$DISPLAY}"
else
  row warn display none 'no window: the demo keeps 12 pictures in kerf-demo (--out DIR: there)'
fi

data=${KERF_DATA:-$root/../shared/data}
if [[ -d $data ]]; then
  row ok KERF_DATA "$(cd "$data" && pwd)"
else
  row warn KERF_DATA 'not set' 'tests skip the real volumes'
fi

free_mib=$(df -Pm "$root" | awk 'NR == 2 { print $4 }')
if ((free_mib >= 4096)); then
  row ok disk "$((free_mib / 1024)) GiB free"
elif [[ -x $bin/kerf-controller ]] && ((free_mib >= 256)); then
  row warn disk "$free_mib MiB free" 'long logs may fill it'
else
  row fail disk "$free_mib MiB free" 'packages and build take 4 GiB: make room'
fi

if [[ ! -x $bin/kerf-controller ]]; then
  row warn demo 'not built' './kerf setup builds it'
  exit "$impossible"
fi
if [[ ${1:-} != --demo ]]; then
  row ok demo 'built; ./kerf doctor --demo tries it and OpenGL (some seconds)'
  exit "$impossible"
fi

# The proof: a second of the demo, in lock-step so that no right is needed.
lab=$(mktemp -d)
trap 'rm -rf "$lab"' EXIT
if KERF_BIN=$bin "$root/kerf" demo --headless --virtual --seconds 1 --out "$lab/out" \
  >"$lab/said" 2>&1; then
  row ok demo 'runs'
else
  row fail demo "$(tail -n 1 "$lab/said")"
fi
pictures=$lab/out/visualizer.json
drawn=$(sed -nE 's/^ *"(gl_renderer|context)": "(.*)",$/\2/p' "$pictures" 2>/dev/null |
  paste -sd '|')
if [[ -n $drawn ]]; then
  row ok OpenGL "${drawn/|/, }"
else
  row fail OpenGL 'no picture was drawn' 'install libegl-mesa0 and libgl1-mesa-dri'
fi
exit "$impossible"
