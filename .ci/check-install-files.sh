#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The files that a user installs by hand: udev rules and systemd unit. Ids agree with the drivers,
# every rule has the form that udev reads (its own `verify` is newer than Debian 12), and systemd
# finds nothing to say about the unit.
set -euo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.."
rules=controller/device/60-kerf.rules
unit=controller/run/kerf@.service
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

if command -v systemd-analyze >/dev/null; then
  lab=$(mktemp -d)
  trap 'rm -rf "$lab"' EXIT
  # Its program lies elsewhere on this machine; any one stands for it.
  sed 's|^ExecStart=[^ ]*|ExecStart=/bin/true|' "$unit" >"$lab/kerf@.service"
  said=$(systemd-analyze verify --man=no "$lab/kerf@.service" 2>&1 | grep 'kerf@' || true)
  [[ -z $said ]] || complain "$unit: $said"
else
  echo 'check-install-files: no systemd-analyze: the unit was not checked' >&2
fi
((failures == 0)) && echo 'check-install-files: fine'
