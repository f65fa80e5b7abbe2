#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The tests of a preset, as ./kerf test and .ci/run run them: side by side on all cores, but those that keep time (labels
# realtime and hil-fuse) alone. If no other test failed, those may try twice more: on a busy machine, a hand can leave before its
# device is armed. At the end, a line names them, and one line each the reasons why tests, or parts of them, were skipped.
#     .ci/tests.sh PRESET [OPTION OF CTEST...]      with --output-junit or --repeat, nothing tries again
# Exit code 1 if a test failed, or if there is none. build/PRESET/Testing/tests.log keeps what ctest prints at the first try.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
build=build/$1 status=0
outputs=$build/Testing/Temporary/LastTest.log said=$build/Testing/tests.log failures=$build/Testing/Temporary/LastTestsFailed.log
mkdir -p "$build/Testing"
rm -f "$outputs" "$said" "$failures"  # if no test matches, ctest leaves an old list
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

# By name: with a label, ctest --rerun-failed takes its numbers for those of other tests.
failed=$(sed 's/^[0-9]*://' "$failures" 2>/dev/null) || true
if ((status)) && [[ -n $failed && " $* " != *' --output-junit '* && " $* " != *' --repeat '* ]]; then
  keep_time=$(ctest --preset "$1" -N -L 'realtime|hil-fuse' | sed -n 's/^ *Test *#[0-9]*: //p')
  if ! grep -qvxFf <(echo "$keep_time") <<<"$failed"; then
    echo "kerf: test: these failed, and they keep time; they try again: $(paste -sd ' ' <<<"$failed")" >&2
    mv "$outputs" "$said.first"
    if ctest --preset "$1" -R "^($(paste -sd '|' <<<"$failed"))\$" --no-tests=error --repeat until-pass:2; then
      echo "kerf: test: passed at a second or third try: $(paste -sd ' ' <<<"$failed")" >&2
      status=0
    fi
    cat "$outputs" >>"$said.first" && mv "$said.first" "$outputs"
  fi
fi
exit "$status"
