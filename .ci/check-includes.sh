#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Who may include whom (docs/architecture.md); prints each line that breaks a rule.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."

# includes PATTERN PATH...: the lines below PATH... that include what matches PATTERN.
includes() {
  local pattern=$1 present=() path
  shift
  for path in "$@"; do
    if [[ -e $path ]]; then present+=("$path"); fi
  done
  if ((${#present[@]})); then
    grep -rnE --include='*.[ch]pp' "#include *$pattern" "${present[@]}" || true
  fi
}

broken() {
  # The programs meet only in shared; hil/lab alone runs the controller's servo step.
  local folder
  for folder in shared controller visualizer hil; do
    includes '"[a-z]+/' "$folder" | grep -vE "#include \"(shared|$folder)/" |
      grep -vE '^hil/lab/.*#include "controller/'
  done
  # A name without a folder would slip through the rule above.
  includes '"[^/"]+"' shared controller visualizer hil tests

  # The loop and its numbers: no header that allocates, throws or prints.
  local heap='vector|string|map|set|unordered_map|unordered_set|deque|list|memory|functional|any'
  heap+='|sstream|iostream|fstream|ostream|istream|stdexcept|thread|mutex|future|filesystem|regex'
  includes "<($heap)>" shared/numeric controller/kernel controller/servo

  # Each big library has one home.
  includes '<(libusb|hidapi)' shared visualizer controller hil | grep -vE '^controller/device/'
  # The kernel's FireWire interface has two sides: the driver that calls it, the node that serves it.
  includes '<linux/firewire' shared visualizer controller hil |
    grep -vE '^(controller/device|hil/front/firewire)/'
  includes '<(GL/|GLES|EGL/|GLFW/|epoxy/|glm/|imgui)' shared controller hil
  # Setting the machine's clock must not reach the loop: its times are CLOCK_MONOTONIC.
  grep -rnE --include='*.[ch]pp' 'system_clock|CLOCK_REALTIME|gettimeofday|timespec_get' \
    controller/servo controller/shell controller/device shared/segment || true
  includes '<itk' shared visualizer hil controller | grep -v '^controller/scene/volume_io.cpp:'
}

found=$(broken || true)
if [[ -n $found ]]; then
  echo "$found"
  echo "check-includes: the lines above cross a border; see docs/architecture.md" >&2
  exit 1
fi
