#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Every fuzzer of tests/fuzz for so many seconds, as many at once as there are cores. Of those that read
# foreign files through the sandbox, whose mutations are blind, one: the day's. What they find out
# about the code stays in build/asan/fuzz; an input that breaks something stays there too and is
# named. Ends with 1 when there is one.
#     .ci/fuzz.sh [SECONDS [NAME...]]      e.g. .ci/fuzz.sh 300 scene
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
seconds=${1:-20}
[[ $seconds =~ ^[1-9][0-9]*$ ]] || {
  echo "fuzz: $seconds: no number of seconds; take 20" >&2
  exit 2
}
build=build/asan
# shellcheck source=cli/build_folder.sh
source cli/build_folder.sh
own_folder "$PWD" "$PWD/$build"
if [[ ! -e $build/CMakeCache.txt || -n ${anew[*]} ]]; then cmake --preset asan "${anew[@]}" --log-level=NOTICE; fi
targets=(fuzzers)
if (($# > 1)); then targets=("${@:2}") && targets=("${targets[@]/#/fuzz_}"); fi
cmake --build "$build" --target "${targets[@]}" >/dev/null
lists=$build/tests/fuzz

# fuzz NAME CORPUS...: one fuzzer; its last lines when it finds something, else its figures.
fuzz() {
  local name=$1 work=$build/fuzz/$1 status=0 own=(-timeout=5)
  # A child may take a second of a core that others want as well; the day's mutations can be repeated. The name of
  # a function is found by a process that stays, and the next input would find a child left.
  if grep -q "^$name " "$lists/importers"; then
    own=(-timeout=60 -seed="$seed" -max_len=8192 -reduce_inputs=0 -print_funcs=0)
  fi
  mkdir -p "$work/inputs"
  # Memory of a text's nesting and of error messages stays far below; so does the time of one input.
  "$build/bin/fuzz_$name" -max_total_time="$seconds" "${own[@]}" -rss_limit_mb=1024 \
    -artifact_prefix="$work/" -print_final_stats=1 "$work/inputs" "${@:2}" \
    >"$work/log" 2>&1 || status=$?
  if ((status)); then
    grep -m 1 '^import: ' "$work/log" >&2  # the reason comes before the stack
    tail -n 30 "$work/log" >&2
    echo "fuzz: $name: found an input (above): $work" >&2
    return 1
  fi
  awk -v name="$name" '/stat::number_of_executed_units/ { runs = $2 } /DONE/ { split($0, a, "cov: ");
    split(a[2], b, " ") } END { printf "fuzz: %s: %d inputs, %d places covered\n", name, runs, b[1] }' \
    "$work/log"
}
seed=${KERF_FUZZ_DAY:-$(($(date -u +%s) / 86400))}
export -f fuzz
export build lists seconds seed
export ASAN_OPTIONS=handle_sigill=1 UBSAN_OPTIONS=print_stacktrace=1

# The lines of the fuzzers that are wanted.
wanted() {
  if (($#)); then
    local name
    for name; do grep -h "^$name " "$lists/fuzzers" "$lists/importers"; done
    return
  fi
  local importers today
  mapfile -t importers <"$lists/importers"
  today=${importers[seed % ${#importers[@]}]}
  echo "fuzz: today's importer: ${today%% *} (KERF_FUZZ_DAY=$seed repeats its mutations)" >&2
  cat "$lists/fuzzers"
  echo "$today"
}

wanted "${@:2}" | nice xargs -P "$(nproc)" -L 1 bash -c 'fuzz "$@"' fuzz || exit 1
