# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Sourced by .ci/run and .ci/all: a timed stage, a build that takes warnings as errors, and the tests of each tier.

# shellcheck source=cli/build_folder.sh
source cli/build_folder.sh

# Real volumes, if they lie beside the checkout.
if [[ -z ${KERF_DATA:-} && -d ../shared/data ]]; then
  KERF_DATA=$(cd ../shared/data && pwd)
  export KERF_DATA
fi

# stage NAME COMMAND...: runs it, prints how long it took, and ends the script if it fails.
stage() {
  local began=$SECONDS status=0
  echo "== $1"
  "${@:2}" </dev/null || status=$?
  echo "== $1: $((SECONDS - began)) s, $SECONDS s in total"
  if ((status)); then
    echo "ci: $1 failed" >&2
    exit 1
  fi
}

# beside NAME COMMAND...: runs it in the background, on the time that the following stages leave free; `joined` waits for it.
# The idle class gives way to every other thread, so tests that keep time do not notice. Linux schedules each session as a
# group where autogroup is on, so the session gets the lowest priority, too.
idle=(nice -n 19)
if chrt --idle 0 true 2>/dev/null; then idle=(chrt --idle 0); fi
beside() {
  beside_name=$1
  beside_log=$(mktemp)
  # shellcheck disable=SC2016  # for the inner shell
  "${idle[@]}" setsid bash -c '{ echo 19 >/proc/self/autogroup; } 2>/dev/null || true; exec "$@"' beside "${@:2}" \
    </dev/null >"$beside_log" 2>&1 &
  beside_process=$!
  trap 'kill -- -$beside_process 2>/dev/null' EXIT
}
finish_beside() {
  local status=0
  wait "$beside_process" || status=$?
  trap - EXIT
  cat "$beside_log"
  rm "$beside_log"
  return "$status"
}
joined() { stage "$beside_name" finish_beside; }

# build_strictly PRESET [TARGET...]: warnings are errors. A cache is worth it only if it outlives this run.
build_strictly() {
  own_folder "$PWD" "$PWD/build/$1"  # a cache of another checkout
  cmake --preset "$1" "${anew[@]}" -DKERF_WERROR=ON ${CCACHE_DIR:+-DKERF_CCACHE=ON} --log-level=NOTICE &&
    cmake --build --preset "$1" ${2:+--target} "${@:2}"
}

# tests NAMES OPTION...: release tests by ctest's options. Tests of NAMES skip themselves if this machine lacks something;
# here they must run.
tests() {
  local name
  .ci/tests.sh release "${@:2}" || return 1
  for name in $1; do
    if grep -q " $name \.* *Passed" build/release/Testing/tests.log; then continue; fi
    echo "ci: $name: did not run (above)" >&2
    return 1
  done
}
