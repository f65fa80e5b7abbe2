#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# clang-tidy 14 over the compile database of a preset; by hand, since it takes minutes.
#     .ci/check-tidy.sh [PRESET] [FILE-REGEX]      e.g. .ci/check-tidy.sh dev controller/kernel
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
preset=${1:-release}
.ci/packages.sh build lint
cmake --preset "$preset" --log-level=NOTICE
# Kernels of another processor are not in the database.
mapfile -t files < <(find shared controller visualizer hil -name '*.cpp' ! -path controller/kernel/sets/neon.cpp |
  grep -E "${2:-.}" | sort)
printf '%s\0' "${files[@]}" |
  xargs -0 -n 1 -P "$(nproc)" clang-tidy-14 --quiet -p "build/$preset"
