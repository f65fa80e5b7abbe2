#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Prints the tests of tiers.txt, which only .ci/all runs, as a pattern for `ctest -E`.
#     .ci/later-tests.sh [BUILD]      with a build folder of all tests: a name that is no test there is refused
set -euo pipefail
list=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/tiers.txt
names=$(sed -n 's/^\([a-z_][a-z_]*\) .*/\1/p' "$list")
if (($#)); then
  known=$(ctest --test-dir "$1" -N | sed -n 's/^ *Test *#[0-9]*: //p')
  unknown=$(grep -vxFf <(echo "$known") <<<"$names" | paste -sd ' ') || true
  if [[ -n $unknown ]]; then
    echo "$list: $unknown: no test of that name in $1, so it would run nowhere or always; mend the name" >&2
    exit 1
  fi
fi
echo "^($(paste -sd '|' <<<"$names"))\$"
