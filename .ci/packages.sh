#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs those Debian packages of the named groups of packages.txt that are missing. Without a
# missing one it prints nothing and never calls apt.
#     .ci/packages.sh [--missing] GROUP...      --missing: print their names only, install nothing
set -euo pipefail
list=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/packages.txt

only_print=
if [[ ${1:-} == --missing ]]; then
  only_print=1
  shift
fi

missing=()
if command -v dpkg-query >/dev/null; then
  declare -A installed=()
  while read -r state name; do
    if [[ $state == installed ]]; then installed[$name]=1; fi
  done < <(dpkg-query -W -f '${db:Status-Status} ${Package}\n')
  while read -r group name _; do
    if [[ " $* " != *" $group "* || -n ${installed[$name]:-} ]]; then continue; fi
    if [[ $name == npm || $name == nodejs ]] && command -v "${name/nodejs/node}" >/dev/null; then continue; fi  # node of its own project
    missing+=("$name")
  done <"$list"
elif [[ -z $only_print ]]; then
  echo "packages: this is not Debian; what $list names is taken as installed" >&2
fi

if ((${#missing[@]} == 0)); then exit 0; fi
if [[ -n $only_print ]]; then
  printf '%s\n' "${missing[@]}"
  exit 0
fi

as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "packages: not root and no sudo; as root: apt-get install ${missing[*]}" >&2
    exit 2
  fi
  as_root=(sudo)
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT
# Never asks, and waits for another apt to finish.
apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get -y -q -o DPkg::Lock::Timeout=300 "$@" >>"$log" 2>&1 </dev/null
}
echo "packages: installing ${#missing[@]} and what they need: ${missing[*]}" >&2
apt update || true  # an old list is often enough; if not, the next line fails and tells
if ! apt install --no-install-recommends "${missing[@]}"; then
  tail -n 20 "$log" >&2
  echo "packages: apt-get failed (above): ${missing[*]}; install them by hand, start again" >&2
  exit 2
fi
