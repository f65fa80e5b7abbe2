# SPDX-License-Identifier: Apache-2.0
# What the cases of cases.txt are made of. Sourced, in the folder of a case.

# scene SED: scene.toml, a small wall and a device whose motors are known, as sed changes them.
scene() {
  { cat scenes/wall.toml && printf '\n[device]\npersonality = "omni"\ntorque_scale = [1, 1, 1]\n'; } |
    sed -E "${1:-}" >scene.toml
}
# nrrd FILE [SED]: 4x4x4 voxels of 1 mm, the header as sed changes it.
nrrd() {
  printf '%s\n' NRRD0004 'type: uint8' 'dimension: 3' 'sizes: 4 4 4' 'spacings: 1 1 1' 'encoding: raw' '' |
    sed -E "${2:-}" >"$1"
  printf '0123456789abcdef%.0s' 1 2 3 4 >>"$1"
}
# png FILE TYPE CHANNELS: 4x4 pixels of zeros; the type is 0 for grey, 2 for red, green and blue, 6 with opacity.
png() {
  python3 - "$@" <<'PY'
import struct, sys, zlib
def chunk(kind, data): return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
name, kind, channels = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
open(name, 'wb').write(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', 4, 4, 8, kind, 0, 0, 0))
                       + chunk(b'IDAT', zlib.compress(bytes(4 * (1 + 4 * channels)))) + chunk(b'IEND', b''))
PY
}
# hand LINE...: hand.toml
hand() { printf '%s\n' "$@" >hand.toml; }

# certificate NAME: NAME.pem for 127.0.0.1, signed by itself, and NAME-key.pem
certificate() {
  openssl req -x509 -newkey ec -pkeyopt group:P-256 -noenc -subj "/CN=$1" -addext subjectAltName=IP:127.0.0.1 \
    -keyout "$1-key.pem" -out "$1.pem" 2>/dev/null
}

# start NAME SECONDS: a controller at work, with an emulator.
start() {
  kerf-emulator --socket socket --hand scenes/hands/touch.toml >/dev/null 2>&1 &
  until [[ -e socket ]]; do sleep 0.01; done
  kerf-controller --scene scenes/wall.toml --name "$1" --port socket:socket --rate 250 --seconds "$2" \
    --torque-scale 1,1,1 >/dev/null 2>&1 &
  local controller=$!
  until [[ -e $XDG_RUNTIME_DIR/kerf/$1.sock ]]; do
    sleep 0.01
    kill -0 $controller || exit
  done
}
# record_log: a recording of half a second, log.
record_log() {
  start one 0.5
  kerf-recorder --name one --out log >/dev/null
}
