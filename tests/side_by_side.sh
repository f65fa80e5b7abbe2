#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs the cases of a doctest program, each in a process of its own, up to N at once: for a program whose cases wait for
# devices and clocks most of the time. Prints what they print, in their order.
#     tests/side_by_side.sh N PROGRAM
# Exit code 1 if a case fails or there is none; 77 if all are skipped.
set -euo pipefail
at_once=$1 program=$2
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

counted=$("$program" --count) || { code=$? && echo "$counted" && exit "$code"; }
count=$(sed -n 's/.*passing the current filters: //p' <<<"$counted")
(( count > 0 )) || { echo "$program has no case: $counted" && exit 1; }

# shellcheck disable=SC2016  # of the inner shell
seq -w "$count" | xargs -P "$at_once" -I CASE bash -c \
  'code=0; "$1" --first="$((10#CASE))" --last="$((10#CASE))" >"$2/CASE" 2>&1 || code=$?; echo "$code" >"$2/CASE.code"' - "$program" "$out"

codes=("$out"/*.code)
(( ${#codes[@]} == count )) || { echo "$program: ${#codes[@]} of $count cases have ended" && exit 1; }
for code in "${codes[@]}"; do cat "${code%.code}"; done
case $(sort -nu "${codes[@]}" | tr '\n' ' ') in
  '0 ' | '0 77 ') ;;
  '77 ') exit 77 ;;
  *) exit 1 ;;
esac
