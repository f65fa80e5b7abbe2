#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A map of both loops with its picture, its portraits, the page at its smallest, and a map from shards.
#     tests/lab/zwidth.sh KERF-LAB
set -euo pipefail
lab=$1
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cd "$dir"

"$lab" zwidth --quick --damping 0.03:0:5 --stiffness 0.05:50:8 --seeds 1 --plot zwidth.svg >told
grep -q 'stiffness of the wall, K (N/mm)' zwidth.svg
grep -q 'servo steps' told
grep -q 'exact for this loop' zwidth.svg
grep -q 'exact for another loop' zwidth.svg
grep -q 'undecided' zwidth.svg
"$lab" zwidth --damping 0.002 --stiffness 1 --plot one.svg >/dev/null  # a single cell
"$lab" zwidth --map numeric,rate --numeric fixed,double --rate 500,1000 --damping 0.002 --stiffness 0.05:50:5 \
  --seeds 1 --plot heights.svg >/dev/null
grep -q 'highest stiffness, by the stricter rule' heights.svg
"$lab" zwidth --portraits portraits.svg --cells 1:0.002,20:0.002 --seconds 0.3
grep -q '<svg' portraits.svg
"$lab" zwidth --arm --portraits arm.svg --cells 1:0.003 --seconds 0.3
grep -q 'corner' arm.svg
"$lab" zwidth --quick --jobs 2 --page stability.md
grep -q '## The effect of each parameter' stability.md
grep -q '](plots/stability.devices.svg)' stability.md
grep -q '<svg' plots/stability.devices.svg
grep -q '<svg' plots/stability.rates.svg

map='--damping 0,0.002,0.01 --delay 0,1 --stiffness 0.2:2:5 --seeds 1'
# shellcheck disable=SC2086  # words
"$lab" zwidth $map --csv whole.csv >/dev/null
if ! command -v parallel >/dev/null; then
  echo 'zwidth: no GNU parallel here; the shards are run one after the other'
  for i in 1 2 3; do
    # shellcheck disable=SC2086
    "$lab" zwidth $map --jobs 1 --shard "$i/3" --part "shard-$i.part" >/dev/null
  done
else
  # shellcheck disable=SC2086
  parallel --will-cite "$lab" zwidth $map --jobs 1 --shard {}/3 --part shard-{}.part ::: 1 2 3 >/dev/null
fi
"$lab" zwidth --merge shard-*.part --csv merged.csv >/dev/null
cmp whole.csv merged.csv
