# SPDX-License-Identifier: Apache-2.0
"""docs/wire.md: the packets of the devices, of kerf's own links and of the bridge, byte by byte, and what the numbers in them
mean. examples/python has a host and a device that were written from this page."""
import math
import re

from layouts import struct_table
from source import Lack, Source, plain, same


def drawing(file, begin):
    """The indented drawing of a header's first comment."""
    lines = [line for line in file.comment_above(begin).split("\n") if line.startswith("    ")]
    if not lines:
        raise Lack(f"{file.path}: no drawing of its bytes; tests/docs/reference has to follow")
    return "\n".join(lines)


def signed(value):
    return f"{'+' if value > 0 else '-'} {plain(abs(value))}"


def serial_arm():
    return """    r = L1 cos q2 + L2 sin q3
    x = -sin q1 r        y = L1 sin q2 - L2 cos q3 + Cy        z = cos q1 r - Cz

    t1 = -cos q1 r Fx - sin q1 r Fz
    t2 = sin q1 L1 sin q2 Fx + L1 cos q2 Fy - cos q1 L1 sin q2 Fz
    t3 = -sin q1 L2 cos q3 Fx + L2 sin q3 Fy + cos q1 L2 cos q3 Fz"""


def omni(root):
    file = Source(root, "shared/wire/omni.hpp")
    number, numbers = file.number, file.numbers
    dock, sign = numbers("kDockRad"), [int(one) for one in numbers("kEncoderSign")]
    slope, offset = numbers("kGimbalSlopeRad"), numbers("kGimbalOffsetRad")
    joints = "\n".join(f"    q{i + 1} = {plain(dock[i])} {signed(sign[i]).split()[0]} c (count{i + 1} - dock{i + 1})" for i in range(3))
    at_dock = number("kUpperLinkMm") * math.cos(dock[1]) + number("kForearmMm") * math.sin(dock[2])
    height = number("kUpperLinkMm") * math.sin(dock[1]) - number("kForearmMm") * math.cos(dock[2]) + number("kOriginHeightMm")
    gimbal = ", ".join(f"{name} {plain(a)} A/(A + B) {signed(b)}" for name, a, b in zip(("yaw", "pitch", "roll"), slope, offset))
    return f"""## Omni

{drawing(file, 'namespace kerf {')}

Bytes that are not listed are written as zero and ignored when read. The words that have a value here have it in every
packet, and a packet with another one is refused. `on` is bit 3 of the word at 6, `lights` its two lowest bits: 0 off, 1 flashes slowly, 2 fast, 3 steady. Of the byte at
19: 1 button 1, 2 button 2, 4 inkwell; each is 0 while it is pressed or docked.

**Speaks first**: the device. It streams by its own clock (in lock-step it sends its first report unasked).

**Packet counter**: one more in each packet. kerf takes a packet whose counter is 1 to 160 ahead of the last one. Up to 16,000
ahead it waits for a second packet that continues it. Any other packet is old: refused until nothing newer has come for 160
ticks, by when the motors are off.

**Counts to joints**, in rad, c = 2 pi / {number('kCountsPerRev')}; `dock` is the count in the inkwell. q1 is the turret, to the left; q2 the
thigh above the horizontal; q3 the forearm from straight down, outwards. All three are against the base.

{joints}

**Joints to tip**, the centre of the gimbal, and **force to torques** in N mm. L1 = L2 = {plain(number('kUpperLinkMm'))}, Cy = {plain(number('kOriginHeightMm'))}, Cz = {plain(number('kOriginDepthMm'))}; in
the inkwell the tip is at (0, {height:.1f}, {at_dock - number('kOriginDepthMm'):.1f}).

{serial_arm()}

**Torques to motors**: the word is {number('kMotorZero'):#x} + t / torque scale, 0 to {number('kMotorWordMax'):#x}. A positive count raises its q. The emulated
device has 0.342 N mm per count.

**Gimbal**, in rad: {gimbal}. The lowest {number('kPotNoiseBits')} bits
are noise. The stylus is turned by Ry(-q1) Rx(-q3) Ry(-yaw) Rx(pitch) Ry(roll); untwisted its shaft points up.

**Calibration**: in the inkwell, for 50 ms, no count moves by more than 2. kerf then sets the light to steady. The emulated
hand takes the stylus 50 ms after it sees that light, or motors that are on, at the latest after 2 s.
"""


def falcon(root):
    file = Source(root, "shared/wire/falcon.hpp")
    number = file.number
    if "kShaftCountsPerRev * kThighWheelMm / kShaftMm" not in file.text or number("kMotorSign") != -1:
        raise Lack(f"{file.path}: counts of a thigh are made otherwise; tests/docs/reference has to follow")
    azimuths = ", ".join(plain(one) for one in file.numbers("kLegAzimuthRad"))
    return f"""## Falcon

Serial, in packets of {number('kPacketBytes')} printable bytes; `shared/wire/falcon.hpp` has the way there over USB.

{drawing(file, 'namespace kerf {')}

A report with other bytes in these places is refused. The host's numbers are motor torques, up to +-{number('kMotorCountMax')}; the device's are encoder counts.

**Speaks first**: the host, with a packet without torque. Host and device take turns: one answer to each packet.

**Counts to joints**: t1 of a leg is {plain(file.numbers('kZeroRad')[0])} degrees + 2 pi count / ({number('kShaftCountsPerRev')} * {plain(number('kThighWheelMm'))} / {plain(number('kShaftMm'))}) once homed; a larger t1 moves the grip
to the user. Before that counts begin at 0 at power-up and jump when the leg is homed.

**Tip to joints**, for the leg at the azimuth phi = {azimuths} degrees (about z, from x to y), in mm: a = {plain(number('kThighMm'))},
b = {plain(number('kShinMm'))}, c = {plain(number('kPlateOutMm'))}, d = {plain(number('kShinEndMm'))}, e = {plain(number('kKneeEndMm'))}, f = {plain(number('kPlateAcrossMm'))}, r = {plain(number('kHipOutMm'))}, s = {plain(number('kHipAcrossMm'))}.

    u = cos phi x + sin phi y - r + c        v = cos phi y - sin phi x - s + f        w = z + {plain(number('kOriginDepthMm'))}
    L = d + e + sqrt(b^2 - v^2)              (u - a cos t1)^2 + (w - a sin t1)^2 = L^2

With E = -2 a u, F = -2 a w, G = u^2 + w^2 + a^2 - L^2 that is t1 = 2 atan2(G + E, sqrt(E^2 + F^2 - G^2) - F). The tip from
the joints is the solution of all three; Newton's steps from (0, 0, 0) reach it everywhere within {plain(number('kReachMm'))} mm.

**Force and torques**: F = SUM t_i (d t1_i / d tip), t_i the torque of leg i in N mm. **A positive count is a negative torque**:
count = -t / torque scale. The emulated device has {plain(number('kOpenDriverNmmPerCount'))} N mm per count.

**Homing**: while a bit of 16, 32, 64 is missing, the host sets bit 1 in every packet, and the user pulls the grip out (t1 above
40 degrees in the emulator) and pushes it in (below 18). **Calibration** of kerf: the centre button, held for 50 ms at rest;
released, the force starts.
"""


def wooden(root):
    file = Source(root, "shared/wire/woodenhaptics.hpp")
    number = file.number
    home = ", ".join(plain(one) for one in file.numbers("kHomeCounts"))
    bodies = [plain(one) for one in file.numbers("kBodyMm")]
    return f"""## WoodenHaptics

HID reports, 14 bytes or the first 14 of 64, seven i16; the host answers in the length that the device has:

{drawing(file, 'namespace kerf {')}

A report of another length than the first one, or with another word at 12 than 0 or 1, is refused.

**Speaks first**: the host, with currents of 0. From then on the device reports every 1 ms; after {plain(number('kWatchdogS'))} s without a packet
it switches its amplifiers off.

**Counts to joints**, in rad: angle = 2 pi / {number('kCountsPerRev')} ({plain(number('kCapstanMm'))} / D) count, D = {', '.join(bodies)} for A, B, C. A turns the
arm to the right, B leans the upper link out from the vertical, C lifts the forearm from straight down, outwards. With

    q1 = -A        q2 = pi/2 - B        q3 = C

the formulas of the Omni hold for tip and torques: L1 = {plain(number('kUpperLinkMm'))}, L2 = {plain(number('kForearmMm'))}, Cy = {plain(number('kShoulderHeightMm') - number('kOriginHeightMm'))}, Cz = {plain(number('kOriginDepthMm'))}.

**Torques to motors**: current = torque / torque scale in mA, up to +-{number('kMaxMilliamps')}; a positive one raises the count: the
torques of A, B, C are -t1, -t2, t3. The emulated device has 0.4144, 0.3108, 0.3108 N mm per mA. `encoder_sign` -1 reverses count and motor.

**Calibration**: in the home pose (A = B = 0, C = pi/2) the user presses the button; the word at 12 stays 1 until the host sets the
encoders. kerf sets them to {home}, 0, 0, 0, without current, and takes the arm for parked until a joint is more than 40
counts from there.
"""


def cartesian(root):
    file = Source(root, "shared/wire/cartesian.hpp")
    number = file.number
    kinds = Source(root, "shared/wire/personality.hpp")
    rows = []
    for row in kinds.text.split("DeviceKind{.personality")[1:]:
        axes = re.search(r"\.axes = \{\{(\d+), (\d+), (\w+), \{([-\d, ]+)\}, \{([-\d, ]+)\}, \{[-\d, ]+\}[^}]*\}\}", row)
        if axes is None:
            continue
        step, quantum, wrist, low, high = axes.groups()
        forces = re.search(r"\.forces = \{([\d., ]+)\}", row)
        word = re.search(r'\.word = "(\w+)"', row)[1]
        rows.append(f"| {word} | {step} | {quantum} | {'yes' if wrist == 'true' else 'no'} "
                    f"| {'anywhere, by a button' if 'has_dock = false' in row else 'in its inkwell'} "
                    f"| ({low}) to ({high}) | {forces[1] if forces else '3.3, 0.88, 0.5'} |")
    if len(rows) != 3:
        raise Lack(f"{kinds.path}: figures of {len(rows)} devices, not 3; tests/docs/reference has to follow")
    table = "\n".join(rows)
    return f"""## Cartesian devices: inverse3, touch, omega

What the vendors' services and libraries say is translated into these packets of kerf's own; the emulator serves them directly
at `--front socket` and `udp`.

{drawing(file, 'namespace kerf {')}

The orientation is that of the tool: identity is a shaft that points up. A position of more than {number('kFarthestUm') // 1000} mm on an axis, or an orientation
whose length is not 1 within 1 %, makes the packet none. The force at 28 is what the sender knows: the emulator's is the one that its
motors give; `kerf-arm`'s the one that it gave the library in the frame before, whatever the device made of it; the Inverse3's what
the service reports since 3.5, and 0 before.

| device | step of the servo, um | resolution, um | orientation | parked | workspace of the emulated one, mm | peak N, continuous N, N/ms |
|---|---|---|---|---|---|---|
{table}

**Speaks first**: the device. **Number**: as the Omni's packet counter. **Force**: it counts while the byte at 10 is 1; the device
clamps it to its peak. **Torque scale**: the true force over the commanded one along x, y, z: 1.
**Calibration**: parked, homed and powered for 50 ms while no axis moves by more than two steps of the resolution.
"""


def inverse3(root):
    file = Source(root, "shared/wire/inverse3.hpp")
    origin = ", ".join(part.strip() for part in re.search(r"kOriginM\{([^}]*)\}", file.text)[1].split(","))
    device = Source(root, "hil/front/inverse3/service_device.hpp")
    profiles = re.findall(r'"([^"]+)"', re.search(r"kServiceProfileWords\{([^}]*)\}", device.text)[1])
    faults = re.findall(r'"([^"]+)"', re.search(r"kServiceFaultWords\{([^}]*)\}", device.text)[1])
    return f"""## The Inverse3's service

`kerf-arm --device inverse3` and `--front websocket`: JSON as text over a WebSocket at port {file.number('kServicePort')}, and events at {file.number('kEventPort')}. The words are those of
the vendor's public pages; the emulated service has the members that kerf reads, and some more.

* **Speaks first**: the service, with the list of its devices and their configuration. Then each message of the client has one
  reply, and nothing else comes. In lock-step a message is one period of the servo.
* **Force**, N: `{{"inverse3": [{{"device_id": "0A1C", "commands": {{"set_cursor_force": {{"vector": {{"x": 0, "y": -0.4, "z": 1.1}}}}}}}}]}}`;
  `values` in place of `vector` before 3.5. It lasts one message.
* **Frame**: X right, Y away from the user, Z up, m. kerf has x = X, y = Z, z = -Y, about ({origin}) m of the service, a choice of ours.
* **Emulated**: versions {", ".join(f"`{word}`" for word in profiles)} (`--profile`); `GET /version`, `/devices`, `/settings/devices/force_scale`. The answer
  to `/version` has a member `kerf_emulator`, by which `kerf-arm` sees whether it runs in lock-step. Faults (`--bus-fault`):
  {", ".join(f"`{word}`" for word in faults)}.
"""


def links(root):
    link = Source(root, "shared/wire/emulator_link.hpp")

    def magic(name):
        marks = re.search(rf"{name}\{{([^}}]*)\}}", link.text)[1]
        return " ".join(mark.strip("'") for mark in marks.split(", "))
    return f"""## kerf's own links

Between the controller (`--port`) and an emulator, on a Unix socket of the kind SOCK_SEQPACKET, or over UDP. **One message is
one packet** of the device, as above, without anything around it. The emulator listens, and the controller connects.

1. **Hello.** The controller sends one first, and over UDP again every 200 ms, until the emulator answers with its own; in
   lock-step, if the two fit, that is the same 20 bytes. What the device sends before the answer is dropped. Another device,
   lock-step on one side only, or in lock-step another rate: the emulator answers all the same, then it ends the link. A host
   that sends no hello is served too.
2. **Who speaks first** then stands with each device: an Omni's first report follows the answer.
3. **In real time** each side sends by its own clock and reads the newest. **In lock-step** the device sends one packet for
   each packet of the host: its state one tick later. Both wait for each other, never for a clock, so a device that has
   nothing to send in a tick sends a turn without packets. A turn with packets says the same as these packets; the emulator
   sends turns only if it plays faults, and the host sends none.
4. **End.** The last packet of a host switches the motors off. On a socket, close it. Over UDP an empty datagram is the
   goodbye (as the first one of a host it does nothing); 2 s of silence of the host end the link too. **A device** ends the
   link by `shutdown(SHUT_WR)`, an empty packet or `close`, over UDP by an empty datagram. kerf reads no more then. Its
   next packet, at most a tick later, switches the motors off, as does each one until it closes its side 2 s later.

| packet | byte | type | what |
|---|---|---|---|
| hello, {link.number('kHelloBytes')} bytes | 0 | u8 x 8 | `{magic('kHelloMagic')}`: the letters as ASCII, then the numbers 0 and 1 as one byte each; the last one is the version |
| | 8 | u8 | device: 0 omni, 1 falcon, 2 woodenhaptics |
| | 9 | u8 | 1: lock-step |
| | 12 | u32 | rate of the servo in Hz; of an emulator in real time that of its packets; 10, 11 and 16 to 19 are 0 |
| turn, at most {link.number('kMostBytes')} bytes | 0 | u8 x 8 | `{magic('kMagic')}` |
| | 8 | | each packet behind a u8 with its length; none: nothing came |
| target, {link.number('kHandTargetBytes')} bytes | 0 | u8 x 8 | `{magic('kHandTargetMagic')}` |
| | 8 | i32 x 3 | place in um, in the device's frame, each up to {link.number('kMaxTargetMm'):g} mm |
| | 20 | i32 x 3 | yaw, pitch, roll in urad, each up to 60 degrees |
| | 32 | u8 | 1 button 1, 2 button 2, 4 park |
| greeting, 9 bytes | 0 | u8 x 8 | that of the target; the emulator says it first |
| | 8 | u8 | 0: the hand is yours; 1: it is taken, and the connection is closed |

A window that leads the hand connects to the emulator's `--hand-socket`, reads the greeting, and sends a target in each
picture. A hello for an Omni in lock-step at 1000 Hz, by Python's `struct`: `pack("<8s2B2xI4x", b"kerf\\0hi\\1", 0, 1, 1000)`.
"""


def bridge(root):
    file, command = Source(root, "bridge/wire/messages.hpp"), Source(root, "shared/segment/command.hpp")
    most_kib = re.search(r"kMaxMessageBytes = (\d+) \* 1024", file.text)[1]
    path = re.search(r'kBridgePath = "([^"]+)"', file.text)[1]

    def messages():
        rows = re.findall(r'(k\w+)Magic = magic\("(\w{4})"\)', file.text)
        structs = dict(zip([row[0] for row in rows], ["HelloMessage", "FrameHead", "RecordsHead", "ReplyMessage", "AckMessage",
                                                      "CommandMessage", "ViewMessage"]))
        # `BlockPlane` is part of the numbering of blocks, not of a message.
        same(file.path, structs.values(), set(re.findall(r"^struct (\w+) \{", file.text, re.M)) - {"BlockPlane"})
        for kind, mark in rows:
            name, size = structs[kind], re.search(rf"sizeof\({structs[kind]}\) == (\d+)", file.text)[1]
            if not name.startswith(kind.removeprefix("k")) or file.struct(name)[1] != int(size):
                raise Lack(f"{file.path}: {name} is not what its magic or its size says")
            rows = struct_table(file, name).replace("where the run stands, above", "where the run stands ([segment](api.md#the-shared-memory))")
            yield f"### `{name}`, `{mark}`\n\n{rows}\n"
    kinds = ", ".join(f'{value} `{word}` ({comment.removeprefix("argument: ")})'
                      for word, value, comment in command.enumerators("CommandKind"))
    replies = ", ".join(f"{value} `{word}` ({comment})" for word, value, comment in command.enumerators("ReplyStatus"))
    hashing = re.search(r"constexpr std::uint64_t block_hash\([^{]*\{(.*?)\n\}", file.text, re.S)[1]
    steps = [line.strip().removesuffix(";").removeprefix("std::uint64_t ") for line in hashing.strip().splitlines()]
    return f"""## Bridge

A WebSocket at `ws://HOST:PORT{path}?token=TOKEN`, `wss://` off loopback, protocol {file.number('kProtocol')}. `kerf-bridge serve` prints host, port
and token.

* `Host:` is an address of the server, `localhost` or a name that `serve` was told: else 421. `Origin:` is left out, or has the
  scheme and host of the request: else 403. A wrong token is answered after 1 s. A browser has a cookie in the token's place.
* Each message is one binary WebSocket message: to the viewer at most {most_kib} KiB, to the server at most {file.number('kMaxUpBytes')} bytes. The magic
  is its first four characters. Times are the server's CLOCK_MONOTONIC.
* **Packed** means: the payload is one block of LZ4 (the block format, without a frame around it), `payload_bytes` long, of which
  `raw_bytes` come out: `lz4.block.decompress(payload, uncompressed_size=raw_bytes)` in Python. Else both lengths are equal.

The server says hello first, and again for a new run; then frames, records, replies and views. The viewer sends an
acknowledgement for each frame that it has applied, commands, and its view where it presents it. What follows a head:

* hello: the volumes' `VolumeDescriptor` ([segment](api.md#the-shared-memory)). `off_labels` is 1 where there are labels; the other
  offsets are 0. Flags: {file.number('kMayCommand')} this viewer may send commands, {file.number('kTwoArms')} the run has two arms.
* frame: u64 version for each block, u32 number for each block, then the payload: the blocks. Flags: {file.number('kPacked')} packed,
  {file.number('kLastOfPass')} last of a pass (the volumes are then those of `tick`), {file.number('kRunEnded')} the controller has gone.
  Blocks are numbered: first the scene's text, {file.number('kTextBlockBytes')} bytes each; then the bricks' densities, {file.number('kDensityBlockBytes')} bytes each, of
  one volume after the other; then the bricks' labels, {file.number('kLabelBlockBytes')} bytes each.
* records: `count` records of `ring` 0 (ticks) or 1 (dirty) as they lie in the segment; number i has the index
  `first + i * stride`. Flag {file.number('kPacked')}: packed. A run of two arms has `ring` 2 in place of 0: each is the first arm's
  record of a tick and, behind it, the second's.
* command: `kind` {kinds}.
* view: of a viewer with the right to command, up to 60 a second, and to all viewers when it changes. One presents; another one gets
  the view of the first. A view that is not finite, beyond 1e5, with the eye at its target or up along the view is left out.
* reply: `status` {replies.replace('`kCommandSlots`', str(command.number('kCommandSlots')))}.

`set_hash` is the sum of `block_hash` over all blocks that the viewer holds, mod 2^64; `session` is that of the hello:

    block_hash(id, version, session):
{chr(10).join('        ' + step for step in steps)}

A connection is closed with {', '.join(f'{value} `{word}`' for word, value, _ in file.enumerators('CloseCode'))}.

{chr(10).join(messages())}"""


def page(root, programs):
    same("shared/wire", ["omni", "falcon", "woodenhaptics", "cartesian", "inverse3", "emulator_link"],
         {path.stem for path in (root / "shared/wire").glob("*.hpp")} - {"little_endian", "personality"})
    return f"""# Wire bytes

All little-endian. The drivers of `controller/device` and the emulator share these layouts, in `shared/wire`.

This page is enough to write a host for the emulator, or a device for the controller. Two examples were written from it:
`examples/python/omni_host.py` and `examples/python/falcon_device.py`. Frame of every device: x right, y up, z to the user, mm.
Torque scales (N mm per count) are the host's setting: `torque_scale` of a scene, `--torque-scale`; `./kerf emulator
--personality D --describe` prints the emulated device's.

{chr(10).join(part(root) for part in (omni, falcon, wooden, cartesian, inverse3, links, bridge))}"""
