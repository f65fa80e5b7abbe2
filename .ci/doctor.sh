#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# `./kerf doctor`: what this machine offers to kerf, and what each lack costs. Installs and builds
# nothing.
# Ends with 1 when the demo cannot run here, else with 0.
set -euo pipefail
root=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." && pwd)
bin=${KERF_BIN:-$root/build/release/bin}
impossible=0

# row ok|warn|fail WHAT FOUND [EFFECT; WAY OUT]
row() {
  if [[ $1 == fail ]]; then impossible=1; fi
  printf '%-4s  %-13s  %s\n' "$1" "$2" "$3"
  if [[ -n ${4:-} ]]; then printf '%21s%s\n' '' "$4"; fi
}

mapfile -t missing < <("$root/.ci/packages.sh" --missing build)
if ((${#missing[@]} == 0)); then
  row ok packages 'all that the build needs'
elif ((EUID == 0)) || command -v sudo >/dev/null; then
  row warn packages "missing: ${missing[*]}" './kerf setup installs them'
else
  row fail packages "missing: ${missing[*]}" 'not root and no sudo: ask who may install packages'
fi

if command -v g++ >/dev/null; then
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

if chrt -f 80 true 2>/dev/null; then
  row ok SCHED_FIFO 'may be taken (priority 80)'
else
  row warn SCHED_FIFO 'no right' \
    'other programs delay ticks by milliseconds; raise rtprio in /etc/security/limits.conf'
fi

memlock=$(ulimit -l)
if [[ $memlock == unlimited ]] || ((EUID == 0)); then
  row ok memlock unlimited
elif ((memlock >= 1024 * 1024)); then
  row ok memlock "$((memlock / 1024)) MiB"
else
  row warn memlock "$((memlock / 1024)) MiB" \
    'a page fault may delay a tick; raise memlock in /etc/security/limits.conf'
fi

throttle=$(cat /proc/sys/kernel/sched_rt_runtime_us 2>/dev/null || echo unknown)
case $throttle in
  -1 | unknown) row ok 'rt throttling' "${throttle/-1/off}" ;;
  *) row ok 'rt throttling' "real-time threads may use $((throttle / 10000)) % of a core" ;;
esac

nodes=(/dev/fw[0-9]*)
if [[ -e ${nodes[0]} ]]; then
  row ok FireWire "${nodes[*]}"
else
  row warn FireWire 'no /dev/fw*' 'no real Omni can be reached; the emulated one needs no bus'
fi

if [[ -r /dev/fuse && -w /dev/fuse ]]; then
  row ok FUSE /dev/fuse
else
  row warn FUSE 'no access to /dev/fuse' 'device nodes cannot be emulated; the socket port can'
fi

if [[ -n ${DISPLAY:-}${WAYLAND_DISPLAY:-} ]]; then
  row ok display "${WAYLAND_DISPLAY:-$DISPLAY}"
else
  row warn display none 'no window: the demo draws 12 pictures to files (--out DIR keeps them)'
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

# The proof: a tenth of a second of the demo, in lock-step so that no right is needed.
if [[ ! -x $bin/kerf-controller ]]; then
  row warn demo 'not built' './kerf setup builds it'
  exit "$impossible"
fi
lab=$(mktemp -d)
trap 'rm -rf "$lab"' EXIT
if KERF_BIN=$bin "$root/kerf" demo --headless --virtual --seconds 0.1 --out "$lab/out" \
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
