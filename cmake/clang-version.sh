#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Prints the version of clang for kerf: 16, with which its pages are made, if that is installed, else the newest one; if
# there is none, the one that this release of Debian or Ubuntu has, for .ci/packages.sh.
for version in 16 $(printf '%s\n' /usr/bin/clang++-[1-9]* | sed -n 's/.*-\([0-9]*\)$/\1/p' | sort -rn); do
  if [ "$version" -ge 16 ] && [ -x "/usr/bin/clang++-$version" ]; then
    echo "$version"
    exit
  fi
done
. /etc/os-release 2>/dev/null || true
case ${ID:-}-${VERSION_ID:-} in
  debian-13) echo 19 ;;
  ubuntu-24.04) echo 18 ;;
  *) echo 16 ;;
esac
