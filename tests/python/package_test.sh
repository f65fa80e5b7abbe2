#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# package_test.sh BUILD: the Debian package python3-kerf has what it promises and no more, and runs from where it is installed.
set -euo pipefail
root=$(dirname "$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")")
home=$(mktemp -d)
trap 'rm -rf "$home"' EXIT
fail() {
  echo "package: $*" >&2
  exit 1
}
for tool in dpkg-shlibdeps file lintian; do
  command -v "$tool" >/dev/null && continue
  echo "skipped: no $tool; apt-get install dpkg-dev file lintian" >&2
  exit 77
done
(cd "$1" && cpack -B "$home/packages" -D CPACK_COMPONENTS_ALL=python >"$home/cpack.log" 2>&1) || { cat "$home/cpack.log" && fail 'cpack'; }
package=$(echo "$home"/packages/python3-kerf_*.deb)
found=$(lintian --no-cfg --fail-on none "$package" 2>/dev/null | grep '^[EW]: ' || true)
[[ -z $found ]] || fail "lintian: $found"

dpkg-deb -c "$package" | awk '{ print $6 }' >"$home/files"
for file in lib/python3/dist-packages/kerf/__init__.py lib/python3/dist-packages/kerf_reader/tick.py share/doc/python3-kerf/copyright \
  share/doc/python3-kerf/changelog.gz; do
  grep -qxF "./usr/$file" "$home/files" || fail "lacks /usr/$file"
done
! grep -E '__pycache__|\.toml$|/module/|/bin/' "$home/files" || fail 'has what it does not need (above)'
depends=$(dpkg-deb -f "$package" Depends)
for name in 'kerf (= ' 'python3 (>= 3.' 'python3 (<< 3.' python3-numpy 'libgdcm3'; do
  [[ ", $depends" == *", $name"* ]] || fail "does not ask for $name: $depends"
done

# The package kerf, for which it asks, has the scenes.
dpkg-deb -x "$package" "$home/root"
mkdir -p "$home/root/usr/share/kerf"
cp -r "$root/scenes" "$home/root/usr/share/kerf"
said=$(cd "$home" && PYTHONPATH=$home/root/usr/lib/python3/dist-packages /usr/bin/python3 -B -c \
  'import kerf; print(kerf.__file__, len(kerf.Loop("touch").run(ticks=100)))')
[[ $said == "$home/root/usr/lib/python3/dist-packages/kerf/__init__.py 100" ]] || fail "import kerf: $said"
