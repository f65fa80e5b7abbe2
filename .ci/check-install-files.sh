#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The files that a user installs by hand: udev rules and systemd units. Ids agree with the drivers,
# every rule has the form that udev reads (its own `verify` is newer than Debian 12), systemd finds
# nothing to say about the units, and only the bridge starts again by itself.
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
