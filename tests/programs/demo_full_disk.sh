#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# demo_full_disk.sh ROOT BIN: a demo whose log meets the end of its disk keeps the ticks so far and all else, reports it in
# one line and ends with 1. Once the limit is that of a file (ulimit -f), once a file system of 24 MiB, if one can be mounted.
set -euo pipefail
root=$1
export KERF_BIN=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# check OUT SECONDS: what the demo left, and its exit code in $code
check() {
  local ticks
  ((code == 1)) || { echo "demo_full_disk: exit code $code and not 1" >&2; cat "$folder/said" >&2; exit 1; }
  (($(grep -c 'ticks.npy: cannot be written' "$folder/said") == 1)) || { cat "$folder/said" >&2; exit 1; }
  "$KERF_BIN/kerf-record" info "$1/log" >"$folder/info"
  ticks=$(awk '$1 == "rows" { print $2 }' "$folder/info")
  ((ticks > 500)) || { echo "demo_full_disk: $ticks rows" >&2; exit 1; }
}

demo=("$root/kerf" demo --headless --virtual --size 160x120 --scene "$root/scenes/touch.toml" --device omni --set 'volume.size=[48, 48, 32]')
code=0
(ulimit -f 3500 && exec "${demo[@]}" --seconds 10 --out "$folder/out") >"$folder/shown" 2>"$folder/said" || code=$?
check "$folder/out"
grep -q '"ticks": 10000' "$folder/out/report.json"  # the run went on to its end
test -e "$folder/out/frame-0012.png"

mkdir "$folder/disk"
# shellcheck disable=SC2016
lack() {
  echo "skipped: a file system that another program fills: no right to $1"
  exit 0
}
unshare -m true 2>/dev/null || lack 'a mount of its own'
code=0
unshare -m bash -c '
  mount -t tmpfs -o size=24m none "$1" || exit 77
  # Room as it is asked for at the start; then another program takes most of it.
  ( until [[ -s $1/out/.kerf-demo/new/log/ticks.npy ]]; do sleep 0.02; done
    head -c 22500K /dev/zero >"$1/others" ) &
  code=0
  "${@:3}" --seconds 12 --out "$1/out" >"$2/shown" 2>"$2/said" || code=$?
  wait
  rm -f "$1/others"
  cp -r "$1/out" "$2/kept" || exit 3
  exit $code' _ "$folder/disk" "$folder" "${demo[@]}" || code=$?
if ((code == 77)); then lack 'mount'; fi
check "$folder/kept"
