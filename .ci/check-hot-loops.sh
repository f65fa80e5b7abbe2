#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# check-hot-loops.sh OBJECT...: the multiply-accumulate loops of these object files keep every sum in
# a register. A compiler that spills one makes its loop up to twice as slow and changes no result.
set -euo pipefail

found=$(objdump -d --no-show-raw-insn -C "$@" | awk '
  function hex(text,    i, n) {
    n = 0
    for (i = 1; i <= length(text); ++i) n = 16 * n + index("0123456789abcdef", substr(text, i, 1)) - 1
    return n
  }
  # The innermost loop that ends at line `last` and begins at address `start`.
  function check_loop(start, last,    i, sums, spills) {
    for (i = last; i > 0 && address[i] >= start; --i) {
      if (i < last && jumps_back[i]) return  # holds another loop
      if (line[i] ~ /vpdpwssd|vpmaddwd/) ++sums
      if (line[i] ~ /[xyz]mm/ && line[i] ~ /\(%rsp/) ++spills
    }
    if (sums < 8) return
    ++loops
    if (spills) print name ": " spills " vectors on the stack in a loop of " sums " products"
  }
  /^[0-9a-f]+ <.*>:$/ { name = $0; sub(":$", "", name); count = 0; split("", line); split("", jumps_back); next }
  /^ +[0-9a-f]+:/ && name ~ /correlate/ {
    at = $1
    sub(":", "", at)
    line[++count] = $0
    address[count] = hex(at)
    if ($2 ~ /^j/ && $3 ~ /^[0-9a-f]+$/ && hex($3) <= address[count]) {
      jumps_back[count] = 1
      check_loop(hex($3), count)
    }
  }
  END { if (!loops) print "no multiply-accumulate loop found" }
')
if [[ -n $found ]]; then
  echo "$found"
  echo "check-hot-loops: sums must stay in registers; see multiply_add in controller/kernel" >&2
  exit 1
fi
