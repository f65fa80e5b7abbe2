#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# check-freestanding.sh COMPILER OBJECT...: these objects, linked with each other and with no library
# at all, ask for nothing but what a compiler itself may emit: no heap, exception, lock, output or
# libm. And every header of the servo core compiles without exceptions and run-time types.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
compiler=$1
shift
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Copies and fills of memory; what kernel_sets() reads at load, of processor and environment.
allowed='mem(cpy|move|set|cmp)|__cpu_model|__cpu_features2|__cpu_indicator_init|getenv'
# Where the linker puts addresses, and the stack check that a distribution may switch on.
allowed+='|_GLOBAL_OFFSET_TABLE_|__stack_chk_fail'

"$compiler" -r -nostdlib -nodefaultlibs -o "$folder/core.o" "$@"
needed=$(nm -u "$folder/core.o" | awk '{print $NF}' | grep -vE "^($allowed)$" | c++filt || true)
if [[ -n $needed ]]; then
  echo "$needed"
  echo "check-freestanding: the servo core needs the symbols above; the loop may not" >&2
  exit 1
fi

# The text of vector kernels is no header of its own: it needs the Simd or the lanes of its includer.
grep -rLE '\b(Simd::|RowSums|weigh_lanes)' --include='*.hpp' --exclude-dir=registry controller/law controller/servo controller/kernel shared/numeric |
  sed 's/.*/#include "&"/' >"$folder/all.cpp"
"$compiler" -std=c++20 -fsyntax-only -fno-exceptions -fno-rtti -I. "$folder/all.cpp"
