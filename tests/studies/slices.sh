#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# slices.sh KERF_LAB KERF_STUDIES: the day's part of the tests that only .ci/all runs as a whole: the fault matrix, pairs of faults, random
# presses, and the ends of scene keys. UTC; KERF_FAULT_DAY=20260131 repeats a day.
set -euo pipefail
lab=$1 studies=$2
day=${KERF_FAULT_DAY:-$(date -u +%Y%m%d)}
part() {
  local program=${!1}
  echo "slices: this part is repeated by: ./kerf $*"
  "$program" "${@:2}"
}
devices=(omni falcon woodenhaptics) rates=(250 500 2000 4000 8000) models=(proxy paper) numerics=(fixed double)
# One of the eight seeds of the test `fault_matrix` at 1 kHz, then its part that goes with the date, for one device.
part lab faults --seeds 1 --seed-base "$((1 + day % 8))"
part lab faults --seeds 1 --seed-base "$day" --device "${devices[day / 3 % 3]}" --rate "${rates[day % 5]}" \
  --model "${models[day % 2]}" --numeric "${numerics[day / 2 % 2]}"
part lab faults --pairs "$((1 + day % 40))/40" --seeds 1
# Twenty presses a scene: two of the twenty scenes of the test `traps`.
part studies extremes --only traps --presses 40 --seed "$((15580 + 2 * (day % 10)))"
part studies ranges --combinations 10 --seed "$day" --numeric "${numerics[day / 2 % 2]}"
part studies ranges --combinations 0 --hours 0.01
