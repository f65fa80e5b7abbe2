#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A machine of its own for kerf: Debian's kernel under QEMU, in virtual time, with nothing in it but
# our programs (docs/stand-ins.md tells what that shows). Needs no root.
#     hil/guest/guest.sh image PROGRAMS FOLDER   makes the image in FOLDER of the programs in PROGRAMS
#     hil/guest/guest.sh boot FOLDER LOG         runs it; what it prints is LOG
#     hil/guest/guest.sh lacks                   says what this machine lacks for that
# FOLDER keeps the kernel, which is Debian's newest when it is first needed. Exit code 77 and one line
# where something is missing.
set -euo pipefail
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
modules=(fuse vhci-hcd hid-generic uhid)
programs=(kerf-controller kerf-emulator kerf-recorder kerf-record kerf-replay test_hil_clients)

lack() {
  echo "guest: $*"
  exit 77
}

# What `./kerf test` and `./kerf doctor` say, too.
check_packages() {
  local name missing=()
  for name in qemu-system-x86_64 busybox; do
    command -v "$name" >/dev/null || missing+=("$name")
  done
  if ((${#missing[@]})); then lack "no ${missing[*]}; .ci/packages.sh guest installs what lacks"; fi
}

# complete KERNEL: it is there with all of the modules.
complete() {
  local name
  for name in "${modules[@]}"; do
    [[ -n $(find "$1/lib/modules" -name "$name.ko" -print -quit 2>/dev/null) ]] || return 1
  done
}

# fetch_kernel FOLDER: the kernel and the modules of its FUSE, USB and HID stacks; never installed.
fetch_kernel() {
  local package part=$1.part
  if complete "$1"; then return; fi
  package=$(apt-cache depends linux-image-amd64 2>/dev/null |
    sed -n 's/^ *Depends: \(linux-image-[0-9].*\)/\1/p') || true
  [[ -n $package ]] || lack "apt knows no linux-image-amd64; apt-get update, on Debian for amd64"
  rm -rf "$1" "$part"
  mkdir -p "$part"
  (cd "$part" && apt-get -q download "$package") >"$part/log" 2>&1 ||
    lack "$package cannot be downloaded ($(tail -n 1 "$part/log"))"
  dpkg-deb --fsys-tarfile "$part/$package"_*.deb | tar -xf - -C "$part" --wildcards \
    './boot/vmlinuz-*' './lib/modules/*/kernel/drivers/usb/*' './lib/modules/*/kernel/drivers/hid/*' \
    './lib/modules/*/kernel/fs/fuse/*'
  rm "$part/$package"_*.deb
  busybox depmod -b "$part" "${package#linux-image-}"
  mv "$part" "$1"
}

# add_programs BIN ROOT: ours and busybox, and the libraries that ours load.
add_programs() {
  local ours=("${programs[@]/#/$1/}") path
  cp "${ours[@]}" "$(command -v busybox)" "$2/bin/"
  ldd "${ours[@]}" | sed -n 's|.*[ \t]\(/[^ ]*\) (0x.*|\1|p' | sort -u | while read -r path; do
    mkdir -p "$2${path%/*}"
    cp -L "$path" "$2$path"
  done
}

# add_modules KERNEL ROOT: those of the list and all that they need.
add_modules() {
  local release name path
  release=$(basename "$1"/lib/modules/*)
  for name in "${modules[@]}"; do
    sed -n "s|^\([^ ]*/$name.ko\):|\1|p" "$1/lib/modules/$release/modules.dep"  # PATH PATH ...
  done | xargs -n 1 | while read -r path; do
    mkdir -p "$2/lib/modules/$release/${path%/*}"
    cp "$1/lib/modules/$release/$path" "$2/lib/modules/$release/$path"
  done
  busybox depmod -b "$2" "$release"
}

make_image() {
  local root=$2/root
  check_packages
  mkdir -p "$2"
  fetch_kernel "$2/kernel"
  rm -rf "$root"
  mkdir -p "$root"/{bin,dev,kerf,proc,run,sys,tmp}
  cp "$here/init" "$root/"
  cp "$here"/*.toml "$root/kerf/"
  head -c 1000 "$here/init" >"$root/kerf/firmware"  # the emulated Falcon takes any bytes for it
  add_programs "$1" "$root"
  add_modules "$2/kernel" "$root"
  (cd "$root" && find . | LC_ALL=C sort | busybox cpio -o -H newc 2>/dev/null) >"$2/image.part"
  mv "$2/image.part" "$2/image"
}

# Guest time is the number of instructions, 2 ns each, and idle time is skipped. A fixed date, one seed
# for all random numbers (trust_cpu: nobody waits for better ones) and fixed addresses make two runs the
# same to the last byte. rr=record is there for its lock, the record is thrown away: without it QEMU's
# timers now and then run before the last instructions of a processor that falls idle are counted, and
# skip too far. For speed the kernel leaves out the tests of its ciphers, and copies by words (-erms),
# because each step of a string instruction counts.
boot() {
  timeout 300 qemu-system-x86_64 -M q35 -accel tcg -cpu max,-erms -smp 1 -m 512 -nodefaults \
    -no-user-config -display none -no-reboot -serial "file:$2" \
    -icount shift=1,sleep=off,rr=record,rrfile=/dev/null -rtc base=2020-01-01T00:00:00,clock=vm -seed 1 \
    -kernel "$1"/kernel/boot/vmlinuz-* -initrd "$1/image" -append "console=ttyS0 quiet panic=-1 \
nokaslr norandmaps random.trust_cpu=1 tsc=reliable lpj=1000000 cryptomgr.notests"
}

case "${1:-}/$#" in
  image/3) make_image "${@:2}" ;;
  boot/3) boot "${@:2}" ;;
  lacks/1) check_packages ;;
  *)
    echo "guest: ${1:-nothing}: say image PROGRAMS FOLDER, boot FOLDER LOG, or lacks" >&2
    exit 2
    ;;
esac
