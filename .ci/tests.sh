#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The tests of a preset, as ./kerf test and .ci/run run them: side by side on all cores, but those that keep time (labels
# realtime and hil-fuse) alone. At the end, one line for each reason why tests, or parts of them, were skipped.
#     .ci/tests.sh PRESET [OPTION OF CTEST...]
# Exit code 1 if a test failed, or if there is none. build/PRESET/Testing/tests.log keeps what ctest prints.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
build=build/$1 status=0
outputs=$build/Testing/Temporary/LastTest.log said=$build/Testing/tests.log
mkdir -p "$build/Testing"
rm -f "$outputs" "$said"
# One more at once than there are cores: some of them wait most of the time.
ctest --preset "$1" --parallel $(($(nproc) + 1)) --no-tests=error --output-log "$PWD/$said" "${@:2}" || status=1

# Why is what a test prints behind "skipped: "; that all of it was skipped is what ctest prints: "1 - NAME (Skipped)".
touch "$outputs" "$said"
awk '
  FILENAME == ARGV[1] { if ($NF == "(Skipped)") whole[$3] = 1; next }
  $1 ~ "^[0-9]+/[0-9]+$" && $2 == "Test:" { test = $3 }
  match($0, /(^|: )skipped: /) {
    why = substr($0, RSTART + RLENGTH)
    told[test] = 1
    if ((why, test) in seen) next
    seen[why, test] = 1
    if (!(why in where)) reasons[++count] = why
    where[why] = where[why] (where[why] == "" ? "" : ", ") (test in whole ? test : "part of " test)
  }
  END {
    for (i = 1; i <= count; ++i) print "kerf: test: " where[reasons[i]] " was skipped: " reasons[i]
    for (test in whole) if (!(test in told)) print "kerf: test: " test " was skipped: its output does not say why"
  }' "$said" "$outputs" >&2
exit "$status"
