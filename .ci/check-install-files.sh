#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The files that a user or a package installs: udev rules, the devices for which a desktop proposes kerf, systemd units.
# Ids agree with the drivers, every rule has the form that udev reads (its own `verify` is newer than Debian 12), systemd
# and AppStream find nothing to say, and only the bridge starts again by itself.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
rules=controller/device/60-kerf.rules
units=(controller/run/kerf@.service bridge/kerf-bridge@.service)
failures=0
complain() {
  echo "check-install-files: $*" >&2
  failures=$((failures + 1))
}

# One rule is KEY==VALUE for what matches and KEY=VALUE or KEY+=VALUE for what is given.
match='(KERNEL|SUBSYSTEM|ATTRS?\{[A-Za-z]+\})=="[^"]*"'
gift='(GROUP="plugdev"|MODE="0660"|TAG\+="uaccess")'
while IFS= read -r line; do
  if [[ -z $line || $line == '#'* ]]; then continue; fi
  [[ $line =~ ^($match,\ )+($gift(,\ |$))+$ ]] || complain "$rules: no rule of udev: $line"
done <"$rules"

# constant FILE NAME: the number behind it, lower case, as sysfs writes it.
constant() { sed -nE "s/.* $2 = 0x([0-9A-Fa-f]+);.*/\L\1/p" "shared/wire/$1"; }
expect_ids() {
  grep -qE "\"$1\".*\"$2\"" "$rules" || complain "$rules: no rule for $1:$2 of shared/wire"
}
expect_ids firewire "0x$(constant omni.hpp kVendorOui)"
expect_ids "$(constant falcon.hpp kVendorId)" "$(constant falcon.hpp kProductId)"
for firmware in Mbed Teensy; do
  expect_ids "$(constant woodenhaptics.hpp "k${firmware}VendorId")" \
    "$(constant woodenhaptics.hpp "k${firmware}ProductId")"
done

# The metainfo has each USB and HID device of the rules, but the SpaceMouse: nobody plugs it in for kerf.
metainfo=controller/device/invalid.kerf.kerf.metainfo.xml
while IFS= read -r line; do
  [[ $line =~ idVendor\}==\"([0-9a-f]{4})\"(.*idProduct\}==\"([0-9a-f]{4})\")? ]] || continue
  id=v${BASH_REMATCH[1]^^}p${BASH_REMATCH[3]^^}
  [[ $line != *hidraw* ]] || id=v0000${BASH_REMATCH[1]^^}p0000${BASH_REMATCH[3]^^}
  case $id in v0000256F* | v0000046D*) continue ;; esac
  grep -q ":[^<]*$id" "$metainfo" || complain "$metainfo: no modalias with $id, which $rules has"
done <"$rules"
if command -v appstreamcli >/dev/null; then
  found=$(appstreamcli validate --no-net "$metainfo" 2>&1) || complain "$metainfo: $found"
fi

grep -qx 'Restart=no' "${units[0]}" || complain "${units[0]}: a fault waits for a person: Restart=no"
grep -qx 'Restart=on-failure' "${units[1]}" || complain "${units[1]}: a bridge that died starts again: Restart=on-failure"

if command -v systemd-analyze >/dev/null; then
  lab=$(mktemp -d)
  trap 'rm -rf "$lab"' EXIT
  # Their programs lie elsewhere on this machine; any one stands for them.
  for unit in "${units[@]}"; do sed 's|^ExecStart=[^ ]*|ExecStart=/bin/true|' "$unit" >"$lab/${unit##*/}"; done
  for unit in "${units[@]}"; do
    said=$(systemd-analyze verify --man=no "$lab/${unit##*/}" 2>&1 | grep -F "${unit##*/}" || true)
    [[ -z $said ]] || complain "$unit: $said"
  done
else
  echo 'check-install-files: no systemd-analyze: the units were not checked' >&2
fi
((failures == 0)) && echo 'check-install-files: fine'
