#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs those Debian packages of the named groups of packages.txt that are missing. Without a
# missing one it prints nothing and never calls apt.
#     .ci/packages.sh [--missing] GROUP...      --missing: print their names only, install nothing
#     .ci/packages.sh --unchanged FILE          ends with 0 if no package came or went since FILE was written, and the list is the
#                                               same: then all are still there
#     .ci/packages.sh --right                   how this user installs: root, sudo, password (sudo asks for one),
#                                               refused (by sudo) or none (no sudo)
set -euo pipefail
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
list=$here/packages.txt

# In which way this user becomes root. sudo says so without asking, but for a password.
right() {
  if (($(id -u) == 0)); then
    echo root
  elif ! command -v sudo >/dev/null; then
    echo none
  elif sudo -n env true 2>/dev/null; then
    echo sudo
  elif [[ $(LC_ALL=C sudo -n -v 2>&1) == *'password is required'* ]]; then
    echo password
  else
    echo refused
  fi
}
has_terminal() { { : </dev/tty; } 2>/dev/null; }

only_print=
case ${1:-} in
  --right) right && exit ;;
  --unchanged)
    [[ $2 -nt /var/lib/dpkg/status && $2 -nt $list ]] && exit
    exit 1
    ;;
  --missing)
    only_print=1
    shift
    ;;
esac

missing=()
if command -v dpkg-query >/dev/null; then
  llvm=$("$here/../cmake/clang-version.sh")
  # shellcheck source=/dev/null
  release=$(. /etc/os-release 2>/dev/null && echo "${VERSION_CODENAME:-}") || release=''
  declare -A installed=()
  while read -r state name; do
    if [[ $state == installed ]]; then installed[$name]=1; fi
  done < <(dpkg-query -W -f '${db:Status-Status} ${Package}\n' 2>/dev/null)
  while read -r group name releases _; do
    name=${name/LLVM/$llvm}
    if [[ " $* " != *" $group "* || -n ${installed[$name]:-} ]]; then continue; fi
    if [[ $releases == [a-z]* && ",$releases," != *",$release,"* ]]; then continue; fi
    if [[ $name == npm || $name == nodejs ]] && command -v "${name/nodejs/node}" >/dev/null; then continue; fi  # node of its own project
    missing+=("$name")
  done <"$list"
elif [[ -z $only_print ]]; then
  for tool in cmake ninja g++ pkg-config python3; do
    command -v "$tool" >/dev/null || missing+=("$tool")
  done
  echo "packages: this is neither Debian nor Ubuntu${missing[*]:+, and it has no ${missing[*]}}; install what $list names, or use the Containerfile" >&2
  exit $((${#missing[@]} ? 2 : 0))
fi

if ((${#missing[@]} == 0)); then exit 0; fi
if [[ -n $only_print ]]; then
  printf '%s\n' "${missing[@]}"
  exit 0
fi

refuse() {
  echo "packages: $1; as root: apt-get install --no-install-recommends ${missing[*]}" >&2
  exit 2
}
as_root=(sudo)
case $(right) in
  root) as_root=() ;;
  none) refuse 'not root and no sudo' ;;
  refused) refuse "sudo does not let $(id -un) install packages" ;;
  password)
    has_terminal || refuse 'sudo asks for a password, and there is no terminal'
    sudo env true || refuse "sudo does not let $(id -un) install packages"  # the password is asked for here
    ;;
esac

# shellcheck source=cli/progress.sh
source "$here/../cli/progress.sh"
log=$(mktemp) || {
  echo "packages: TMPDIR=${TMPDIR:-/tmp}: cannot be written; make it, or name another folder" >&2
  exit 2
}
trap 'rm -f "$log"' EXIT
# Never asks, and waits for another apt to finish. Its status lines go the way of its output, since sudo closes all others.
apt() {
  local end=$1
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 \
    apt-get -y -q -o DPkg::Lock::Timeout=300 -o APT::Status-Fd=1 "${@:2}" 2>&1 </dev/null |
    tee -a "$log" | sed -un 's/.*\([dp][lm]status:[^:]*:[0-9.]*:\)/\1/p' | show_steps "$end" >&2
}
# How many packages that is, and what is fetched for them: "36 packages and 251 that they need, 291 MB".
size() {
  LC_ALL=C apt-get -y --print-uris --no-install-recommends install "${missing[@]}" 2>/dev/null | awk -v named="${#missing[@]}" '
    / newly installed/ { for (i = 2; i <= NF; ++i) if ($i == "newly") all = $(i - 1) }
    /^Need to get / { size = $4; unit = $5; sub("/.*", "", unit) }
    END { printf "%d package%s", named, named == 1 ? "" : "s"; if (all > named) printf " and %d that they need", all - named
      if (size != "") printf ", %s %s", size, unit }'
}
first=${KERF_DONE:-0} end=${KERF_END:-100}
echo "packages: reading apt's lists" >&2
update_end=$((first + (end - first) / 20))
apt "$update_end" update || true  # an old list is often enough; if not, a line below fails and tells
export KERF_DONE=$update_end
unknown=()
for name in "${missing[@]}"; do
  apt-cache show "$name" >/dev/null 2>&1 || unknown+=("$name")
done
if ((${#unknown[@]})); then
  tail -n 5 "$log" >&2
  echo "packages: apt knows no ${unknown[*]}; kerf needs the archive of Debian 12 or 13 or Ubuntu 24.04, and a network; or use the Containerfile" >&2
  exit 2
fi
echo "packages: installing $(size): ${missing[*]}" >&2
if ! apt "$end" install --no-install-recommends "${missing[@]}"; then
  grep -v 'status:' "$log" | tail -n 20 >&2
  echo "packages: apt-get failed (above): ${missing[*]}; install them by hand, start again" >&2
  exit 2
fi
