#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Each type has one definition in each program: link-time optimisation sees them all and names two that differ. Builds
# in build/odr, at -O1, since only the linker's comparison counts.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
programs=(kerf-controller kerf-emulator kerf-visualizer kerf-recorder kerf-record kerf-replay kerf-volume kerf-lab kerf-studies kerf-bridge kerf-arm)
cmake --preset release -B build/odr --log-level=NOTICE -DCMAKE_CXX_FLAGS_RELEASE=-O1 \
  -DCMAKE_CXX_FLAGS='-flto=auto -Wodr' -DCMAKE_EXE_LINKER_FLAGS='-flto=auto -Wodr' \
  -DCMAKE_AR="$(command -v gcc-ar)" -DCMAKE_RANLIB="$(command -v gcc-ranlib)"
cmake --build build/odr --target "${programs[@]}" 2>&1 | tee build/odr/log
if grep -n 'Wodr' build/odr/log | grep 'warning:'; then
  echo 'check-odr: the types above have two definitions in one program: rename one' >&2
  exit 1
fi
