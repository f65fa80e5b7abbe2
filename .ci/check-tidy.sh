#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# clang-tidy over shared, controller, hil, arm and visualizer; by .ci/all and by hand, since it takes half an hour.
#     .ci/check-tidy.sh [FILE-REGEX]      e.g. .ci/check-tidy.sh controller/kernel
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
.ci/packages.sh build check lint
clang=$(cmake/clang-version.sh)
# One file at a time by its own compiler: neither joined files nor precompiled headers.
cmake -B build/tidy -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER="clang++-$clang" -DCMAKE_EXPORT_COMPILE_COMMANDS=ON \
  -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DKERF_JOIN_FILES=OFF --log-level=NOTICE
# Kernels of another processor are not in the database.
mapfile -t files < <(find shared controller visualizer hil arm -name '*.cpp' ! -path controller/kernel/sets/neon.cpp ! -path controller/kernel/sets/simd128.cpp |
  grep -E "${1:-.}" | sort)
printf '%s\0' "${files[@]}" |
  xargs -0 -n 1 -P "$(nproc)" "clang-tidy-$clang" --quiet -p build/tidy --extra-arg=-Wno-unused-command-line-argument
