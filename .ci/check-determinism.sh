#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The golden run (tests/golden) and the recorded runs (tests/replay/inputs) on several compilers,
# optimisation levels and processors, each with every kernel set that it runs; other processors under
# qemu (a Cortex-M7 without an operating system, too), WebAssembly under Node. Prints a table; fails where a hash is not the known one. Builds without any library.
#     .ci/check-determinism.sh [--all]      --all: every combination, a quarter of an hour
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
folder=build/determinism
clang=clang++-$(cmake/clang-version.sh)
row='%-22s %-20s %-9s %-5s %-7s %-16s %-16s %-16s %7s\n'

# check PROCESSOR COMPILER FLAGS: builds, runs, prints the rows of the table; false if any differs.
check() {
  local processor=$1 compiler=$2 flags=$3 name options=() targets=(test_golden test_load) run=() result
  name=$folder/$processor-$compiler${flags// /}
  if [[ $processor == wasm32 ]]; then
    # Of golden alone: the standard library there reads no files, from which scenes are loaded.
    options=(--toolchain cmake/wasm32-wasi.cmake)
    targets=(test_golden)
    run=(node --no-warnings .ci/run-wasi.js)
  elif [[ $processor == arm ]]; then
    options=(-DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=arm)
    run=(qemu-arm-static -L /usr/arm-linux-gnueabihf)
  elif [[ $processor != "$(uname -m)" ]]; then
    options=(-DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR="$processor")
    run=("qemu-$processor-static" -L "/usr/$processor-linux-gnu")
  fi
  # These have kernels of their own.
  if [[ $processor == aarch64 || $processor == wasm32 ]]; then targets+=(test_aligned); fi
  if [[ $processor != s390x && $processor != wasm32 ]]; then
    targets+=(test_recorded_inputs)  # logs are little-endian
  fi

  # doctest is only headers; those of the other processor come first.
  if ! { cmake -S . -B "$name" -G Ninja -DKERF_CORE_ONLY=ON -DKERF_WERROR=ON \
    -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_COMPILER="$compiler" \
    -DCMAKE_CXX_FLAGS="$flags -idirafter /usr/include" "${options[@]}" &&
    cmake --build "$name" -j 1 --target "${targets[@]}"; } >"$name.log" 2>&1; then
    echo "check-determinism: $compiler $flags: does not build; see $name.log" >&2
    return 1
  fi
  # Against their definitions, since the tests of each change never run them.
  if [[ " ${targets[*]} " == *" test_aligned "* ]] && ! result=$("${run[@]}" "$name/bin/test_aligned"); then
    echo "$result"
    return 1
  fi
  # What load time makes of each shipped scene.
  if [[ $processor != wasm32 ]] && ! result=$("${run[@]}" "$name/bin/test_load"); then
    echo "$result"
    return 1
  fi
  # What the servo was given in runs that g++ -O2 recorded on x86-64.
  if [[ " ${targets[*]} " == *" test_recorded_inputs "* ]] && ! result=$("${run[@]}" "$name/bin/test_recorded_inputs"); then
    echo "$result"
    return 1
  fi
  local status=0
  result=$("${run[@]}" "$name/bin/test_golden") || status=$?
  rows "$processor" "$compiler" "$flags" <<<"$result"
  if ((status)); then
    grep -v '^golden ' <<<"$result" || true
    return 1
  fi
  # The scenes that this build compiles, on a processor without an operating system.
  if [[ $processor == arm ]]; then
    result=$(.ci/check-bare-metal.sh) || status=$?
    rows cortex-m7 arm-none-eabi-g++ -Os <<<"$result"
    return "$status"
  fi
}

# rows PROCESSOR COMPILER FLAGS: the table's rows of a golden run, from its lines
# golden SCENE NUMBERS KERNELS HASH VOLUME_HASH SECONDS; double does not depend on the kernels.
rows() {
  awk -v compiler="$2" -v flags="$3" -v processor="$1" -v row="$row" '
    $1 != "golden" { next }
    $3 == "fixed" { line[++rows] = $0; next }
    { other[$2] = $5; other_seconds[$2] += $7 }
    END {
      for (i = 1; i <= rows; ++i) {
        split(line[i], field)
        scene = field[2]
        printf row, compiler, flags, processor, scene, field[4], field[5], field[6],
          other[scene],
          sprintf("%.1f", field[7] + other_seconds[scene])
        other[scene] = "same run"
        other_seconds[scene] = 0
      }
    }'
}

# The levels of x86-64 that this machine runs, the highest last.
levels() {
  echo x86-64
  /lib64/ld-linux-x86-64.so.2 --help | sed -nE 's/^ +(x86-64-v[34]) \(supported.*/\1/p' | sort
}

# What to check, a line each: PROCESSOR COMPILER FLAGS. The longest first.
list() {
  local optimise compiler level
  if [[ ${1:-} != --all ]]; then  # beside g++ -O2 and clang -O2, which the other tests build with
    echo s390x s390x-linux-gnu-g++ -O2
    echo arm arm-linux-gnueabihf-g++ -O2
    echo wasm32 "$clang" -O2
    echo aarch64 aarch64-linux-gnu-g++ -O2
    echo x86_64 "$clang" -O3 -march=x86-64
    echo x86_64 g++ -O3 "-march=$(levels | tail -n 1)"
    return
  fi
  for optimise in -O2 -O3; do  # -O0 takes a quarter of an hour under qemu
    echo s390x s390x-linux-gnu-g++ "$optimise"
    echo aarch64 aarch64-linux-gnu-g++ "$optimise"
  done
  for optimise in -O0 -O2 -O3; do
    for compiler in g++ "$clang"; do
      for level in $(levels); do echo x86_64 "$compiler" "$optimise" "-march=$level"; done
    done
  done
}

mkdir -p "$folder"
# shellcheck disable=SC2059
printf "$row" compiler flags machine scene kernels fixed 'its volume' double seconds
failed=0 running=0
collect() {
  wait -n || failed=$((failed + 1))
  running=$((running - 1))
}
while read -r processor compiler flags; do
  if ((running == $(nproc))); then collect; fi
  check "$processor" "$compiler" "$flags" &
  running=$((running + 1))
done < <(list "$@")
while ((running)); do collect; done
if ((failed)); then
  echo "check-determinism: $failed builds are not as tests/golden says; docs/determinism.md" >&2
  exit 1
fi
