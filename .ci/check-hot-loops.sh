#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# check-hot-loops.sh OBJECT...: the innermost loops of these object files that correlate, cut and place
# keep every vector in a register. A compiler that spills one makes its loop up to twice as slow and
# changes no result. Left out: `press`, whose filters have more taps and rows than AVX2 has registers,
# and `gather` and `splat`, which hand groups of samples on in arrays on the stack.
set -euo pipefail

found=$(objdump -d --no-show-raw-insn -C "$@" | awk '
  function hex(text,    i, n) {
    n = 0
    for (i = 1; i <= length(text); ++i) n = 16 * n + index("0123456789abcdef", substr(text, i, 1)) - 1
    return n
  }
  # The innermost loop that ends at line `last` and begins at address `start`.
  function check_loop(start, last,    i, vectors, spills) {
    for (i = last; i > 0 && address[i] >= start; --i) {
      if (i < last && jumps_back[i]) return  # holds another loop
      if (line[i] ~ /[yz]mm/) ++vectors
      if (line[i] ~ /[xyz]mm/ && line[i] ~ /\(%r[sb]p/) ++spills
    }
    if (vectors < 8) return
    ++loops
    if (spills) print name ": " spills " vectors on the stack in a loop of " vectors " vector instructions"
  }
  /^[0-9a-f]+ <.*>:$/ { name = $0; sub(":$", "", name); count = 0; split("", line); split("", jumps_back); next }
  /^ +[0-9a-f]+:/ && name ~ /::(correlate|cut|place)/ {
    at = $1
    sub(":", "", at)
    line[++count] = $0
    address[count] = hex(at)
    if ($2 ~ /^j/ && $3 ~ /^[0-9a-f]+$/ && hex($3) <= address[count]) {
      jumps_back[count] = 1
      check_loop(hex($3), count)
    }
  }
  END { if (!loops) print "no loop of vectors found" }
')
if [[ -n $found ]]; then
  echo "$found"
  echo "check-hot-loops: vectors must stay in registers; see multiply_add in controller/kernel" >&2
  exit 1
fi
