#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds programs of others against kerf's stand-ins, runs each for 60 s with a spring about the origin, and compares what it read
# and sent with the mechanics of the emulator. By hand, not in a change: it fetches their sources, and needs their packages.
#
#     tests/standin/others/run.sh chai3d FOLDER      CHAI3D 3.3 and a Force Dimension omega.3, in real time
#     tests/standin/others/run.sh phantom FOLDER     after chai3d: CHAI3D and a Touch, with the stand-in's headers of HD and HDU
#     tests/standin/others/run.sh pyhaptic FOLDER    after chai3d: pyhaptic and an omega.3, in lock-step
#
# FOLDER keeps sources and builds; what lies there already is not fetched again. CHAI3D's tree has headers and an archive of the
# vendor, under the vendor's terms: the archive is removed, so that the program is linked with the stand-in.
set -euo pipefail
usage() { sed -n '6,8s/^# *//p' "$0"; exit 2; }
(($# == 2)) || usage
what=$1 folder=$(mkdir -p "$2" && realpath "$2")
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")") root=$(readlink -f "$(dirname "${BASH_SOURCE[0]}")/../../..")
libraries=$root/build/release/stand-in
# Their loops keep no time on a busy machine: CHAI3D sets the omega's watchdog to 32 ms, and a pause of that length ends the force.
in_time=()
if chrt -f 60 true 2>/dev/null; then in_time=(chrt -f 60); fi

# get NAME URL: their newest sources, in FOLDER/NAME.
get() { [[ -d $folder/$1 ]] || git clone --depth 1 "https://github.com/$2" "$folder/$1"; }

# compare FILE.json FILE.txt MAP: the report beside what the program printed. MAP: the program's x, y, z in the device's axes.
compare() { python3 -B "$here/compare.py" "$@"; }

client() {  # CHAI3D as a library, and one loop of our own over it
  g++ -O1 -std=gnu++14 -w -DLINUX -I"$folder/chai3d/src" -I"$folder/chai3d/externals/Eigen" \
    -I"$folder/chai3d/externals/glew/include" "$here/chai3d_spring.cpp" -o "$folder/chai3d_spring" -L"$folder/chai3d-build" -lchai3d \
    -L"$libraries" -ldrd -lpthread -lrt -ldl -lGL -lGLU -lusb-1.0 -lasound
}

case $what in
  chai3d)
    "$root/kerf" _programs emulator stand-in
    get chai3d chai3d/chai3d
    rm -rf "$folder/chai3d/externals/DHD/lib"
    cmake -S "$folder/chai3d" -B "$folder/chai3d-build" -G Ninja -Wno-dev -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE=-O0 \
      -DCMAKE_EXE_LINKER_FLAGS="-L$libraries" >"$folder/chai3d.log"
    cmake --build "$folder/chai3d-build" --target 01-mydevice >>"$folder/chai3d.log"
    client
    "$root/kerf" stand-in --device omega --hand "$here/hand.toml" --report "$folder/chai3d.json" -- \
      "${in_time[@]}" "$folder/chai3d_spring" 60 100 | tee "$folder/chai3d.txt"
    compare "$folder/chai3d.json" "$folder/chai3d.txt" zxy
    ;;
  phantom)
    g++ -O1 -std=gnu++14 -w -DLINUX -DGLEW_STATIC -fPIC -shared -I"$root/standin/include" \
      -I"$folder/chai3d/src" -I"$folder/chai3d/externals/Eigen" -I"$folder/chai3d/externals/glew/include" \
      -I"$folder/chai3d/externals/DHD/include" "$folder/chai3d/extras/hdPhantom/hdPhantom.cpp" -o "$folder/libhdPhantom.so" \
      -L"$libraries" -lHD
    client
    # It never closes the device (a todo in its source), which the stand-in reports: exit code 1.
    "$root/kerf" stand-in --hand "$here/hand.toml" --report "$folder/phantom.json" -- \
      bash -c "LD_LIBRARY_PATH=$folder:\$LD_LIBRARY_PATH exec ${in_time[*]} $folder/chai3d_spring 60 30" | tee "$folder/phantom.txt" || true
    compare "$folder/phantom.json" "$folder/phantom.txt" zxy
    ;;
  pyhaptic)
    get pyhaptic louisgevers/pyhaptic
    [[ -e $folder/pyhaptic/src/dhd/include/pybind11/CMakeLists.txt ]] ||
      git clone --depth 1 https://github.com/pybind/pybind11 "$folder/pyhaptic/src/dhd/include/pybind11"
    mkdir -p "$folder/sdk/lib/release"  # as the vendor's tree lies
    ln -sfn "$folder/chai3d/externals/DHD/include" "$folder/sdk/include"
    ln -sfn "$libraries" "$folder/sdk/lib/release/lin-$(uname -m)-gcc"
    FORCE_DIMENSION_SDK=$folder/sdk cmake -S "$folder/pyhaptic/src/dhd" -B "$folder/pyhaptic-build" -DCMAKE_BUILD_TYPE=Release \
      -DCMAKE_LIBRARY_OUTPUT_DIRECTORY="$folder/pyhaptic/src/pyhaptic" >"$folder/pyhaptic.log"
    cmake --build "$folder/pyhaptic-build" --target dhd >>"$folder/pyhaptic.log"
    PYTHONPATH=$folder/pyhaptic/src "$root/kerf" stand-in --device omega --lockstep --hand "$here/hand.toml" \
      --report "$folder/pyhaptic.json" -- python3 "$here/pyhaptic_spring.py" 60 200 | tee "$folder/pyhaptic.txt"
    compare "$folder/pyhaptic.json" "$folder/pyhaptic.txt" zxy
    ;;
  *) usage ;;
esac
