#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# fault_matrix.sh KERF_LAB SEEDS: the fault matrix as ctest runs it: every script at 1 kHz, an Inverse3 behind its service
# too, then a part that goes with the date (UTC; KERF_FAULT_DAY=20260131 repeats a day): rate, force model, numbers and
# seeds. That part has as many ticks at every rate, or one seed's.
set -euo pipefail
lab=$1 seeds=$2
day=${KERF_FAULT_DAY:-$(date -u +%Y%m%d)}
rates=(250 2000 4000 8000 500) models=(proxy paper) numerics=(fixed double)
rate=${rates[day % 5]}
most=$((seeds * 1000 / rate))
rotating=(faults --rate "$rate" --model "${models[day % 2]}" --numeric "${numerics[day / 2 % 2]}"
  --seed-base "$day" --seeds "$((most > 0 ? most : 1))")
echo "fault_matrix: today's part is repeated by: ./kerf lab ${rotating[*]}"
"$lab" faults --seeds "$seeds"
"$lab" faults --device inverse3 --port ws --seeds 1
"$lab" "${rotating[@]}"
