#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The golden run on an Arm Cortex-M7 without an operating system (examples/bare-metal, docs/determinism.md), under QEMU: its
# bits, its stack against the bound from the compiler's figures, that there is no heap, and that a stack too small is seen.
# Prints the lines of each image. Exit code 77: a compiler or QEMU is missing.
#     .ci/check-bare-metal.sh [--compile]      --compile: only whether that compiler takes the core; 10 s
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
flags=(-std=c++20 -mcpu=cortex-m7 -mthumb -mfpu=fpv5-d16 -mfloat-abi=hard -fno-exceptions -fno-rtti -ffp-contract=off
  -Wall -Wextra -Wconversion -Wpedantic -Werror)
if [[ ${1:-} == --compile ]]; then
  if ! command -v arm-none-eabi-g++ >/dev/null; then
    echo 'skipped: no arm-none-eabi-g++; .ci/packages.sh all installs it'
    exit 77
  fi
  for source in controller/servo/*.cpp controller/kernel/sets/scalar.cpp shared/volume/checksum.cpp examples/bare-metal/run.cpp; do
    arm-none-eabi-g++ "${flags[@]}" -fsyntax-only -I. -DKERF_SCENE=mill -DKERF_NUMBERS=FixedNumbers "$source"
  done
  exit
fi
for tool in arm-none-eabi-g++ arm-linux-gnueabihf-g++ qemu-arm-static qemu-system-arm; do
  if ! command -v "$tool" >/dev/null; then
    echo "check-bare-metal: $tool is missing; .ci/packages.sh all installs it" >&2
    exit 77
  fi
done
fail() {
  echo "check-bare-metal: $*" >&2
  exit 1
}

# The build of .ci/check-determinism.sh for 32-bit ARM has the program that compiles the scenes.
linux=build/determinism/arm-arm-linux-gnueabihf-g++-O2
images=build/determinism/cortex-m7
plans=$PWD/$images/plans
scenes='mill_fixed feel_fixed sweep_fixed mill_double feel_double'
mkdir -p "$plans"
if ! { cmake -S . -B "$linux" -G Ninja -DKERF_CORE_ONLY=ON -DKERF_WERROR=ON -DCMAKE_BUILD_TYPE=None \
  -DCMAKE_CXX_COMPILER=arm-linux-gnueabihf-g++ -DCMAKE_CXX_FLAGS="-O2 -idirafter /usr/include" \
  -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=arm && cmake --build "$linux" -j 1 --target write_plan; } >"$images/write_plan.log" 2>&1; then
  fail "write_plan does not build; see $images/write_plan.log"
fi
for scene in $scenes; do
  qemu-arm-static -L /usr/arm-linux-gnueabihf "$linux/bin/write_plan" "${scene%_*}" "${scene#*_}" >"$plans/$scene.s.new"
  if cmp -s "$plans/$scene.s.new" "$plans/$scene.s"; then rm "$plans/$scene.s.new"; else mv "$plans/$scene.s.new" "$plans/$scene.s"; fi
done
# Never through ccache: it keeps objects, but not the compiler's figures of the stack.
if ! { cmake -S . -B "$images" -G Ninja --toolchain cmake/cortex-m7.cmake -DKERF_CORE_ONLY=ON -DKERF_WERROR=ON \
  -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-Os -DCMAKE_CXX_COMPILER_LAUNCHER= -DKERF_PLANS="$plans" &&
  cmake --build "$images" -j 1 --target bare_metal; } >"$images/images.log" 2>&1; then
  fail "the images do not build; see $images/images.log"
fi

# run IMAGE: one instruction takes 32 ns of virtual time, whatever the machine does.
run() {
  timeout 1800 qemu-system-arm -M mps2-an500 -display none -monitor none -serial none -chardev stdio,id=host \
    -semihosting-config enable=on,target=native,chardev=host -icount shift=5 -kernel "$images/bin/$1.elf" </dev/null
}

mapfile -t graphs < <(find "$images"/controller/{servo,kernel} "$images/examples/bare-metal/CMakeFiles/kerf_bare.dir" -name '*.ci')
for scene in $scenes; do
  began=$SECONDS status=0
  said=$(run "$scene") || status=$?
  sed "1s/\$/ $((SECONDS - began))/" <<<"$said"
  ((status == 0)) || fail "$scene ended with exit code $status; docs/determinism.md says what each means"
  heap=$(arm-none-eabi-nm "$images/bin/$scene.elf" | grep -E ' (_*(malloc|calloc|realloc|free|sbrk)(_r)?|_Zn[wa].*|_Zd[la].*|__cxa_.*)$' || true)
  [[ -z $heap ]] || fail "$scene has a heap or exceptions: $heap"
  bound=$(examples/bare-metal/stack_bound.py "${graphs[@]}" "$images/examples/bare-metal/CMakeFiles/$scene.dir/run.cpp.ci")
  echo "stack bound by the compiler's figures: $bound bytes"
  read -r used room < <(sed -nE 's/^stack: ([0-9]+) of ([0-9]+) bytes$/\1 \2/p' <<<"$said")
  ((used <= bound && bound <= room)) ||
    fail "$scene: a stack of $used bytes was used, $bound is the bound, $room is there; make kerf_stack of mps2-an500.ld the bound"
done

status=0
said=$(run small_stack) || status=$?
[[ $status == 3 && $said == *'the stack of 4096 bytes overflowed'* ]] ||
  fail "a stack of 4096 bytes ended with exit code $status, not in a fault that is told: $said"
echo "$said"
