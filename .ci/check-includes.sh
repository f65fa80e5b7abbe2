#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Who may include whom (docs/architecture.md), and how full a folder may be; prints each line that breaks a rule.
# .ci/mutate.py proves that it can fail.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

# The rooms, from the lowest floor up: a room includes only what stands above it in this list, so no
# two folders can include each other. The programs meet only in shared; but lab, which measures, also
# includes controller, record, arm and hil, replay, which repeats a run, controller and record, face, which is
# all of it for other programs, these, and web, which is a whole demo and a
# replay in one module, controller, record, replay, hil, face and bridge. A folder that is missing here is refused.
rooms='
include/kerf

shared/numeric shared/volume shared/wire shared/text shared/posix shared/device shared/segment shared/external shared/arm

controller/kernel/point_shell controller/kernel controller/kernel/proxy controller/kernel/sets
controller/law controller/servo controller/tick controller/law/registry
controller/stability controller/input controller/scene controller/volume/file controller/volume controller/tool controller/load
controller/plan/tables controller/plan/method controller/plan controller/volume_tool
controller/device/port controller/device/firewire controller/device/arm controller/device
controller/loop controller/run controller

record record/check record/run record/export

replay

arm/inverse3 arm

hil hil/device hil/front hil/front/fuse hil/front/firewire hil/front/usb hil/front/inverse3 hil/script hil/program

standin standin/hd standin/dhd standin/wheel

lab/run lab/rig lab/accuracy lab/bench lab/stability lab/impedance lab/safety lab/commands lab/reproduce lab

face

python/module

visualizer/scene visualizer/scene/simd visualizer/sound visualizer/gl visualizer/cast visualizer/cast/simd visualizer/surface
visualizer/redraw visualizer/render visualizer/compose visualizer/panels visualizer/picture visualizer/app visualizer/bench

bridge/wire bridge/stream bridge/foxglove bridge/igtl bridge/page bridge/net bridge/join bridge/serve bridge

web/absent web
'
programs=(include shared controller record replay arm hil standin lab face python visualizer bridge web)
hash='^[[:space:]]*#[[:space:]]*include[[:space:]]*'

# includes PATTERN PATH...: the lines below PATH... that include what matches PATTERN.
includes() {
  local pattern=$1
  shift
  grep -rnE --include='*.[ch]pp' "$hash$pattern" "$@" || true
}

# Each folder of C++ is a room, each room has C++, and no C++ has another ending, which no check sees.
rooms_and_folders() {
  local known folders
  known=$(tr -s ' \n' '\n' <<<"$rooms" | sed '/^$/d' | sort)
  folders=$(find . -path './.*' -prune -o -path ./build -prune -o -path ./out -prune -o \
    -path ./tests -prune -o -path ./examples -prune -o -name '*.[ch]pp' -printf '%P\n' | sed 's|/*[^/]*$||' | sort -u)
  comm -13 <(echo "$known") <(echo "$folders") | sed 's|$|/   <- no room of that name|'
  comm -23 <(echo "$known") <(echo "$folders") | sed 's|$|/   <- a room without C++|'
  # Headers for other people's programs have the names that those programs include.
  find "${programs[@]}" tests \( -path standin/include -o -path include/kerf/external.h \) -prune -o -regextype egrep -regex '.*\.(c|h|cc|hh|cxx|hxx|c\+\+|h\+\+|inl|ipp|tpp)' \
    -printf '%p   <- C++ ends in .cpp or .hpp\n'
}

# No folder has more files of its own than can be read at a glance. Where git knows the tree, it says what belongs there.
full_folders() {
  local files
  files=$(git ls-files 2>/dev/null || true)
  [[ -n $files ]] || files=$(find . -type f -printf '%P\n')
  sed -E 's|^[^/]*$|./&|; s|/[^/]*$||' <<<"$files" | sort | uniq -c |
    awk '$1 > 40 { count = $1; sub("^ *[0-9]+ ", ""); print $0 "/   <- " count " files, of 40 at most; make a room below" }'
}

# What is loaded and stepped has the same bits on every machine, so it calls no function whose last bit the C library chooses:
# shared/numeric/elementary.hpp has others. Messages and bounds of stability may.
libm_calls() {
  grep -nE --include='*.[ch]pp' -r '\bstd::(sin|cos|tan|asin|acos|atan|atan2|sinh|cosh|tanh|exp|exp2|expm1|log|log2|log10|log1p|pow|cbrt|hypot|fma)\(' \
    shared/numeric shared/volume controller/kernel controller/law controller/servo controller/volume controller/tool \
    controller/load controller/plan controller/scene hil/device | sed 's|$|   <- take it from shared/numeric/elementary.hpp|' || true
}

# Each include of another room, against the list. What stands in quotes is of ours.
between_rooms() {
  local ours
  ours=$(IFS='|' && echo "${programs[*]}|tests|\.")
  includes "(\"|<($ours)[/.])" "${programs[@]}" | awk -v rooms="$rooms" '
    function room_of(path) { sub("/[^/]*$", "", path); return path }
    function program_of(path) { sub("/.*", "", path); return path }
    BEGIN {
      split(rooms, list)
      for (i in list) floor[list[i]] = i
    }
    {
      file = $0; sub(":.*", "", file)
      included = $0; sub("^[^\"<]*[\"<]", "", included); sub("[\">].*", "", included)
      sub("^kerf/", "include/kerf/", included)  # as other programs include it
      from = room_of(file); to = room_of(included)
      p = program_of(from); q = program_of(to)
      if (file == "include/kerf/law.hpp" && q == "controller") next  # a law is a template, so its parts are seen
      if (!(to in floor)) why = "includes from no room"
      else if (p != q && q != "shared" && q != "include" && !(p == "lab" && q != "visualizer") &&
          !(p == "face" && (q == "controller" || q == "record" || q == "replay" || q == "hil" || q == "lab")) &&
          !(p == "replay" && (q == "controller" || q == "record")) &&
          !(p == "web" && (q == "controller" || q == "record" || q == "replay" || q == "hil" || q == "face" || q == "bridge"))) why = "the programs meet only in shared"
      else if (floor[to] + 0 > floor[from] + 0) why = "includes from a floor above"
      else next
      print $0 "   <- " why
    }'
}

broken() {
  rooms_and_folders
  full_folders
  between_rooms
  libm_calls
  # A name without a folder would slip through the rule above.
  includes '"[^/"]+"' "${programs[@]}" tests

  # The loop and its numbers: no header that allocates, throws or prints.
  local heap='vector|string|map|set|unordered_map|unordered_set|deque|list|memory|functional|any'
  heap+='|sstream|iostream|fstream|ostream|istream|stdexcept|thread|mutex|future|filesystem|regex'
  includes "<($heap)>" shared/numeric controller/kernel controller/law/*.?pp controller/servo

  # Nor the segment: what a tick gives away, the shell writes there.
  includes '"shared/(text|posix|segment)/' controller/kernel controller/law/*.?pp controller/servo

  # These are large templates, and every file that sees one pays seconds for it: one file each. JSON has a second one,
  # which reads a device's messages without making values of them.
  local large='^(shared/text/(command_line\.cpp:.*<CLI/|json\.cpp:.*<nlohmann/|toml\.cpp:.*<toml\+\+/)'
  large+='|arm/inverse3/messages\.cpp:.*<nlohmann/)'
  includes '<(CLI/|nlohmann/|toml)' "${programs[@]}" tests | grep -vE "$large"
  # Below the loop and the segment: the standard library, and what is named here.
  local posix='(fcntl|netdb|poll|pthread|sched|unistd|sys/(eventfd|file|mman|random|resource|socket|stat|time|un))\.h'
  includes '<' shared controller/kernel controller/law controller/servo |
    grep -vE "include[[:space:]]*<[a-z_]+>|$large" |
    grep -vE "^shared/(posix|segment|external|arm)/.*<$posix>" |
    grep -vE '^shared/arm/arm_page.cpp:.*<(linux/futex|sys/syscall)\.h>' |
    grep -vE '^shared/posix/report_tool.cpp:.*<(spawn|sys/wait)\.h>' |
    grep -vE '^shared/posix/gzip_writer.cpp:.*<zlib\.h>' |
    grep -vE '^controller/kernel/.*<(immintrin|arm_neon|wasm_simd128)\.h>'

  # Each big library has one home; hidapi a second one, for what is no haptic device.
  includes '<libusb' "${programs[@]}" | grep -v '^controller/device/port/'
  includes '<hidapi' "${programs[@]}" | grep -vE '^(controller/device/port/|visualizer/app/hand_control.cpp)'
  # The kernel's FireWire interface has two sides: the driver that calls it, the node that serves it.
  includes '<linux/firewire' "${programs[@]}" |
    grep -vE '^(controller/device/firewire|hil/front/firewire)/'
  includes '<(GL/|GLES|EGL/|GLFW/|epoxy/|glm/|imgui)' "${programs[@]}" | grep -v '^visualizer/'
  includes '<AL/' "${programs[@]}" | grep -v '^visualizer/sound/spindle_sound.cpp:'
  # Setting the machine's clock must not reach the loop: its times are CLOCK_MONOTONIC.
  grep -rnE --include='*.[ch]pp' 'system_clock|CLOCK_REALTIME|gettimeofday|timespec_get' \
    controller/servo controller/loop controller/run controller/device shared/segment \
    shared/posix/monotonic_clock.hpp || true
  includes '<gdcm' "${programs[@]}" | grep -v '^controller/volume/file/dicom_[a-z]*\.[ch]pp:'
  includes '<(archive|archive_entry|expat)\.h' "${programs[@]}" |
    grep -vE '^controller/volume/file/(foreign_invesalius|voxel_files).cpp:'
  includes '<(nifti/|tiff)' "${programs[@]}" | grep -vE '^controller/volume/file/(nifti|tiff)\.cpp:'
  includes '<(boost|openssl)/' "${programs[@]}" | grep -vE '^(bridge/(net|join|serve)/|arm/inverse3/web_socket.cpp|hil/front/inverse3/service_front.cpp)'
  includes '<lz4' "${programs[@]}" | grep -vE '^(bridge/wire/compression|record/export/mcap_file).cpp:'
  includes '<hdf5' "${programs[@]}" | grep -v '^record/export/hdf5_export.cpp:'
  includes '<igtl' "${programs[@]}" | grep -v '^bridge/igtl/'
  includes '<pybind11' "${programs[@]}" | grep -v '^python/module/'
  includes '<qrencode' "${programs[@]}" | grep -v '^bridge/serve/serve.cpp:'
}

found=$(broken || true)
if [[ -n $found ]]; then
  echo "$found"
  echo "check-includes: the lines above cross a border; see docs/architecture.md" >&2
  exit 1
fi
