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

# What this kerf is called, and whether a clone or an installed one.
me=./kerf
if [[ ! -e $root/CMakeLists.txt ]]; then
  me=kerf
  bin=${KERF_BIN:-$(readlink -m "$root/../../bin")}
fi
# shellcheck source=cli/build_folder.sh
source "$root/cli/build_folder.sh"
# Programs of this clone: those that came with a copy of another one are built anew.
built() { [[ -x $bin/kerf-controller ]] && { [[ $me == kerf || -n ${KERF_BIN:-} ]] || ! made_for "$root" "${bin%/bin}" >/dev/null; }; }

# shellcheck source=/dev/null
system=$(. /etc/os-release 2>/dev/null && echo "${ID:-} ${VERSION_ID:-}" && echo "${PRETTY_NAME:-${ID:-}}") || true
case ${system%%$'\n'*} in
  'debian 12' | 'debian 13') row ok system "${system#*$'\n'}" ;;
  *) row warn system "${system#*$'\n'}" 'kerf was tried on Debian 12 and 13: docs/compatibility.md; elsewhere the Containerfile runs it' ;;
esac

right=$("$root/.ci/packages.sh" --right 2>/dev/null) || right=none  # how this user installs packages

# packages: those of the build, and whether this user can install what is missing. Without them ./kerf demo does not start,
# unless KERF_BIN names built programs.
packages() {
  local missing grave=fail
  if ! command -v dpkg-query >/dev/null; then
    row warn packages 'unknown: there is no dpkg' 'what .ci/packages.txt names must be installed by hand'
    return
  fi
  mapfile -t missing < <("$root/.ci/packages.sh" --missing build)
  if ((${#missing[@]} == 0)); then
    row ok packages 'all that the build needs'
    return
  fi
  if [[ -n ${KERF_BIN:-} ]]; then grave=warn; fi
  case $right in
    root | sudo) row warn packages "missing: ${missing[*]}" './kerf setup installs them' ;;
    password)
      if { : </dev/tty; } 2>/dev/null; then
        row warn packages "missing: ${missing[*]}" './kerf setup installs them; sudo asks for your password'
      else
        row "$grave" packages "missing: ${missing[*]}" 'sudo asks for a password: start ./kerf setup on a terminal'
      fi
      ;;
    refused)
      row "$grave" packages "missing: ${missing[*]}" "sudo does not let $(id -un) install packages: ask who may"
      ;;
    none) row "$grave" packages "missing: ${missing[*]}" 'not root and no sudo: ask who may install packages' ;;
  esac
}

# tools: what builds kerf. Where dpkg is, packages brings them.
tools() {
  local tool lack=()
  for tool in cmake ninja g++ pkg-config; do
    command -v "$tool" >/dev/null || lack+=("$tool")
  done
  if ((${#lack[@]} == 0)); then
    row ok compiler "$(g++ --version | head -n 1)"
  elif command -v dpkg-query >/dev/null; then
    row warn compiler "missing: ${lack[*]}" 'comes with the packages'
  else
    row fail compiler "missing: ${lack[*]}" 'install them, or use the Containerfile'
  fi
}

# programs: those of a demo, where kerf is installed.
programs() {
  local name lack=()
  for name in controller emulator visualizer recorder record; do
    [[ -x $bin/kerf-$name ]] || lack+=("kerf-$name")
  done
  if ((${#lack[@]})); then
    row fail kerf "installed, without ${lack[*]} in $bin" 'install the package kerf again: docs/compatibility.md'
  else
    row ok kerf "$("$bin/kerf-controller" --version 2>&1 | head -n 1), installed"
  fi
  if [[ ! -x /usr/bin/python3 ]]; then row fail python3 'no /usr/bin/python3' 'install the package python3: the demo is written in it'; fi
}

if [[ $me == kerf ]]; then
  programs
else
  packages
  tools
fi

for folder in "${TMPDIR:-/tmp}" /dev/shm; do
  if [[ ! -d $folder || ! -w $folder ]]; then
    row fail "$folder" 'no folder that can be written' 'a demo keeps its sockets and volumes there: make it, or for the first set TMPDIR'
  fi
done
if [[ $me != kerf && -z ${KERF_BIN:-} ]]; then
  for folder in "$root/build" "$root"; do  # the first one that is there
    [[ -e $folder ]] || continue
    if [[ -w $folder ]]; then break; fi
    if built; then
      row warn "${folder##*/}" "$folder: cannot be written" 'what is built runs, as long as it is up to date'
    else
      row fail "${folder##*/}" "$folder: cannot be written" "give $(id -un) the rights, or make a copy of your own"
    fi
    break
  done
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
    'one that never sleeps stops all others of its core: docs/first-hour.md, "50 ms in each second"' ;;
esac

# Devices, rights to them and real-time rights: the controller's own look around.
if built; then
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
  row warn device 'not looked for' 'kerf-controller looks for it: not there yet'
fi

if [[ -r /dev/fuse && -w /dev/fuse ]]; then
  row ok FUSE /dev/fuse
else
  row warn FUSE 'no access to /dev/fuse' 'device nodes cannot be emulated; the socket port can'
fi

if [[ $me == kerf ]]; then
  true  # no tests
elif reason=$("$root/hil/guest/guest.sh" lacks); then
  row ok QEMU "$(qemu-system-x86_64 --version | sed -n '1s/.*version \([0-9.]*\).*/\1/p')"
else
  reason=${reason#guest: }
  if [[ $right == refused || $right == none ]]; then way=''; else way="; ${reason#*; }"; fi
  row warn QEMU "${reason%%; *}" "the test hil_guest is skipped$way"
fi

if [[ $me != kerf ]] && command -v dpkg-query >/dev/null; then
  libraries=$(dpkg-query -W -f '${db:Status-Status} ${Package} ${Version}\n' libusb-1.0-0-dev libhidapi-dev \
    libseccomp-dev libgdcm-dev 2>/dev/null | sed -nE 's/^installed //; T; s/(-dev)? ([0-9]+:)?([0-9.]+).*/ \3/p' |
    paste -sd ',' | sed 's/,/, /g') || true
  if [[ -n $libraries ]]; then row ok libraries "$libraries"; fi
fi

if [[ -n ${DISPLAY:-}${WAYLAND_DISPLAY:-} ]]; then
  row ok display "${WAYLAND_DISPLAY:-$DISPLAY}"
else
  row warn display none 'no window: the demo keeps 12 pictures in kerf-demo (--out DIR: there)'
fi

data=${KERF_DATA:-$root/../shared/data}
if [[ $me == kerf ]]; then
  true  # no tests
elif [[ -d $data ]]; then
  row ok KERF_DATA "$(cd "$data" && pwd)"
else
  row warn KERF_DATA 'not set' 'tests skip the real volumes'
fi

free_mib=$(df -Pm "$root" | awk 'NR == 2 { print $4 }')
if ((free_mib >= 4096)); then
  row ok disk "$((free_mib / 1024)) GiB free"
elif built && ((free_mib >= 256)); then
  row warn disk "$free_mib MiB free" 'long logs may fill it'
elif built; then
  row fail disk "$free_mib MiB free" 'a demo and its pictures take 256 MiB: make room'
else
  row fail disk "$free_mib MiB free" 'packages and build take 4 GiB: make room'
fi

if ((impossible)); then
  row fail demo 'cannot run: see above'
  exit 1
elif ! built; then
  row warn demo 'not built' './kerf setup builds it'
  exit 0
elif [[ ${1:-} != --demo ]]; then
  row ok demo "$([[ $me == kerf ]] && echo installed || echo built); $me doctor --demo tries it and OpenGL (some seconds)"
  exit 0
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
