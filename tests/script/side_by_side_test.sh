#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tests/side_by_side.sh with a stand-in for a doctest program: every case runs once, at most N at once, and none that fails,
# crashes or is skipped gets lost.
#     side_by_side_test.sh ROOT
set -euo pipefail
root=$1
lab=$(mktemp -d)
trap 'rm -rf "$lab"' EXIT
wrong=0

# ENDS has the exit code of each case; of `crash` a signal. COUNT: what --count ends with, if not 0.
cat >"$lab/program" <<'PROGRAM'
#!/usr/bin/env bash
read -ra ends <<<"$ENDS"
if [[ $1 == --count ]]; then
  echo "[doctest] unskipped test cases passing the current filters: ${#ends[@]}"
  exit "${COUNT:-0}"
fi
[[ $1 == "--first=${2#--last=}" ]] || exit 9
case=${2#--last=}
echo "$case" >>"$LAB/ran"
mkdir "$LAB/running/$case"
find "$LAB/running" -mindepth 1 | wc -l >>"$LAB/at_once"
sleep 0.1
rmdir "$LAB/running/$case"
echo "case $case has ended"
[[ ${ends[case - 1]} == crash ]] && kill -SEGV $$
exit "${ends[case - 1]}"
PROGRAM
chmod +x "$lab/program"

# gives CODE ENDS [COUNT]: the script ends with CODE; its output is in $lab/said.
gives() {
  rm -rf "$lab/running" "$lab/ran" "$lab/at_once"
  mkdir "$lab/running"
  local code=0
  LAB=$lab ENDS=$2 COUNT=${3:-0} TMPDIR=$lab "$root/tests/side_by_side.sh" 3 "$lab/program" >"$lab/said" 2>&1 || code=$?
  if [[ $code != "$1" ]]; then
    echo "cases that end with '$2': exit code $code, not $1"
    cat "$lab/said"
    wrong=1
  fi
}
expect() {
  if "${@:2}"; then return; fi
  echo "$1: no"
  wrong=1
}
same() { [[ $1 == "$2" ]]; }

gives 0 '0 0 0 0 0 0 0 0 0 0 0'
expect 'each case once' same "$(sort -n "$lab/ran" | paste -sd ' ')" '1 2 3 4 5 6 7 8 9 10 11'
expect 'printed in their order' same "$(sed -n 's/^case \([0-9]*\) .*/\1/p' "$lab/said" | paste -sd ' ')" '1 2 3 4 5 6 7 8 9 10 11'
expect 'three at most' same "$(sort -n "$lab/at_once" | tail -n 1)" 3
gives 1 '0 0 0 0 1'
expect 'what fails is printed' grep -q '^case 5 has ended$' "$lab/said"
expect 'all others ran' same "$(wc -l <"$lab/ran")" 5
gives 1 '1 0 0 0'
gives 1 '0 crash 0'
gives 1 '77 0 1'
gives 0 '77 0 0'
gives 77 '77 77'
gives 1 ''
expect 'and is told' grep -q 'has no case' "$lab/said"
gives 77 '0 0' 77
gives 139 '0 0' 139
expect 'nothing is left' same "$(find "$lab" -mindepth 1 -maxdepth 1 -name 'tmp.*')" ''
exit "$wrong"
