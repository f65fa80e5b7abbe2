#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# check-waits.sh OBJECT... -- OBJECT...: the first are those of the servo step, the others those of KERF_WAITS, which have -O1.
# The linker keeps one copy of an inline function for a whole program, so no function of the first may also be in the others:
# the servo could run a copy of -O1. Prints each that is in both.
set -euo pipefail

# functions OBJECT...: "NAME OBJECT" of each function that an object shares with others of that name.
functions() { nm -A --defined-only "$@" | awk '$2 == "W" { object = $1; sub(/:[0-9a-f]*$/, "", object); print $3, object }' | sort; }

servo=() waits=() at=servo
for object in "$@"; do
  if [[ $object == -- ]]; then at=waits; elif [[ $at == servo ]]; then servo+=("$object"); else waits+=("$object"); fi
done
found=$(join <(functions "${servo[@]}" | awk '{ print $1 }' | uniq) <(functions "${waits[@]}") | c++filt)
if [[ -n $found ]]; then
  echo "$found"
  echo 'check-waits: the servo step could run these functions from an object of -O1; set no KERF_WAITS for its target' >&2
  exit 1
fi
