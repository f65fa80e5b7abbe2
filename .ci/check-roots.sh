#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The two commands of the README, typed in a bare clone of this commit in fresh root file systems of Debian: on 12 as root, on 13
# as a user with sudo. Each root has only what debootstrap makes, git and sudo. Half an hour or more each; 8 GB in build/roots.
#     .ci/check-roots.sh [RELEASE:USER...]      for example trixie:root; without one: bookworm:root trixie:ada
# Root only. build/roots/RELEASE-USER.log keeps what was printed. Ends with 1 at the first command that fails.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
if ((EUID)); then
  echo "check-roots: a root file system needs root; take sudo .ci/check-roots.sh" >&2
  exit 2
fi
command -v debootstrap >/dev/null || apt-get install -y -qq debootstrap
# The mounts of a root are seen by this process and its children alone, so they are gone when it ends, however it ends.
if [[ ${KERF_OWN_MOUNTS:-} != yes ]]; then KERF_OWN_MOUNTS=yes exec unshare --mount --propagation private "$0" "$@"; fi

fresh_root() {  # RELEASE USER FOLDER; one chain, because its caller asks for its exit code
  rm -rf "$3" && mkdir -p "$3" && debootstrap --include=ca-certificates,git,sudo "$1" "$3" &&
    mount -t proc proc "$3/proc" && mount --rbind /dev "$3/dev" && mount --rbind /sys "$3/sys" &&
    cp -L /etc/resolv.conf "$3/etc/resolv.conf" && git clone -q --bare --no-local . "$3/srv/kerf.git" || return 1
  if [[ $2 != root ]]; then
    chroot "$3" useradd -m -s /bin/bash "$2" && echo "$2 ALL=(ALL) NOPASSWD:ALL" >"$3/etc/sudoers.d/$2"
  fi
}
# typed FOLDER USER LINE: as this user in its home, without a variable of ours.
typed() {
  chroot "$1" /usr/bin/env -i TERM=dumb /bin/su - "$2" -c "$3" </dev/null
}

(($#)) || set -- bookworm:root trixie:ada
for pair in "$@"; do
  if [[ ! $pair =~ ^[a-z]+:[a-z]+$ ]]; then
    echo "check-roots: $pair: no RELEASE:USER; take for example trixie:root" >&2
    exit 2
  fi
done
mkdir -p build/roots
for pair in "$@"; do
  release=${pair%:*} user=${pair#*:} folder=$PWD/build/roots/${pair/:/-}
  fresh_root "$release" "$user" "$folder" >"$folder.log" 2>&1 || {
    echo "check-roots: $release: no root file system; see $folder.log" >&2
    exit 1
  }
  typed "$folder" "$user" "git config --global safe.directory '*' && git clone -q /srv/kerf.git kerf"
  for words in 'demo --headless --seconds 5' test; do
    began=$SECONDS status=0
    typed "$folder" "$user" "cd kerf && ./kerf $words" >>"$folder.log" 2>&1 || status=$?
    echo "$release, $user: ./kerf $words: exit code $status, $((SECONDS - began)) s"
    if ((status)); then exit 1; fi
  done
  umount -R "$folder/proc" "$folder/dev" "$folder/sys"
  rm -rf "$folder"
done
