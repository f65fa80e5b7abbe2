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

Bytes that are not listed are sent as zero and ignored when read. A word that has a value in this table has that value in every
packet. A packet with another value is refused.

* Host word at 6: `on` is bit 3 and switches the motors on. `lights` is the two lowest bits: 0 off, 1 flashes slowly, 2 flashes
  fast, 3 steady.
* Device byte at 19: bit 0 is button 1, bit 1 is button 2, bit 2 is the inkwell. A bit is 0 if the button is pressed or the
  stylus is docked.

**Speaks first**: the device. It streams at the rate of its clock. In lock-step it sends its first report before any command.

**Packet counter**: increases by 1 in each packet. kerf compares it with the newest packet that it accepted:

* 1 to 160 ahead: accepted.
* 161 to 16,000 ahead: refused. If the next packet is 1 to 160 ahead of the refused one, it is accepted.
* Any other counter is that of an old packet: refused. One exception: after 160 ticks without an accepted packet (the motors are
  then off), the next packet is accepted if it is 1 to 160 ahead of the refused one.

**Counts to joints**, in rad, with c = 2 pi / {number('kCountsPerRev')}. `dock` is the count in the inkwell. q1 turns the turret to the left. q2 is the
angle of the thigh above the horizontal. q3 is the angle of the forearm from straight down, outwards. All three angles are
relative to the base.

{joints}

**Joints to tip and force to torques**: the tip is the centre of the gimbal; torques are in N mm. L1 = L2 = {plain(number('kUpperLinkMm'))} mm,
Cy = {plain(number('kOriginHeightMm'))} mm, Cz = {plain(number('kOriginDepthMm'))} mm. In the inkwell the tip is at (0, {height:.1f}, {at_dock - number('kOriginDepthMm'):.1f}).

{serial_arm()}

**Torques to motors**: the motor word is {number('kMotorZero'):#x} + t / torque scale, clamped to 0 to {number('kMotorWordMax'):#x}. A positive count increases q of its joint.
The torque scale of the emulated device is 0.342 N mm per count.

**Gimbal**, in rad: {gimbal}. The lowest {number('kPotNoiseBits')} bits
of A and B are noise. The orientation of the stylus is Ry(-q1) Rx(-q3) Ry(-yaw) Rx(pitch) Ry(roll). At identity its shaft points
up.

**Calibration**: kerf calibrates when the stylus is in the inkwell and no count has moved by more than 2 for 50 ms. kerf then
sets the light to steady. The emulated hand picks up the stylus 50 ms after the light is steady or the motors are on. If neither
happens, the hand picks up the stylus 2 s after the host's first packet.
"""


def falcon(root):
    file = Source(root, "shared/wire/falcon.hpp")
    number = file.number
    if "kShaftCountsPerRev * kThighWheelMm / kShaftMm" not in file.text or number("kMotorSign") != -1:
        raise Lack(f"{file.path}: counts of a thigh are made otherwise; tests/docs/reference has to follow")
    azimuths = ", ".join(plain(one) for one in file.numbers("kLegAzimuthRad"))
    return f"""## Falcon

A serial stream of packets of {number('kPacketBytes')} printable bytes. How a host opens it over USB is in `shared/wire/falcon.hpp`.

{drawing(file, 'namespace kerf {')}

A report with a byte that this layout does not allow is refused. The numbers of the host are motor torques in counts, up to
+-{number('kMotorCountMax')}. The numbers of the device are encoder counts.

**Speaks first**: the host, with a packet without torque. The device answers each packet of the host with one report.

**Counts to joints**: t1 is the angle of a leg's thigh, from u towards w (below). Once the leg is homed,
t1 = {plain(file.numbers('kZeroRad')[0])} degrees + 2 pi count / ({number('kShaftCountsPerRev')} * {plain(number('kThighWheelMm'))} / {plain(number('kShaftMm'))}).
A larger t1 moves the grip towards the user. Counts start at 0 at power-up and jump when the leg is homed.

**Tip to joints**, for the leg at the azimuth phi = {azimuths} degrees (about z, from x to y), in mm: a = {plain(number('kThighMm'))},
b = {plain(number('kShinMm'))}, c = {plain(number('kPlateOutMm'))}, d = {plain(number('kShinEndMm'))}, e = {plain(number('kKneeEndMm'))}, f = {plain(number('kPlateAcrossMm'))}, r = {plain(number('kHipOutMm'))}, s = {plain(number('kHipAcrossMm'))}.

    u = cos phi x + sin phi y - r + c        v = cos phi y - sin phi x - s + f        w = z + {plain(number('kOriginDepthMm'))}
    L = d + e + sqrt(b^2 - v^2)              (u - a cos t1)^2 + (w - a sin t1)^2 = L^2

With E = -2 a u, F = -2 a w, G = u^2 + w^2 + a^2 - L^2 the solution is t1 = 2 atan2(G + E, sqrt(E^2 + F^2 - G^2) - F). The tip
follows from the joints as the common solution of the equations of the three legs. Newton's method from (0, 0, 0) converges to
every tip within {plain(number('kReachMm'))} mm of the origin.

**Force and torques**: F = SUM t_i (d t1_i / d tip), where t_i is the torque of leg i in N mm. **A positive count is a negative
torque**: count = -t / torque scale. The torque scale of the emulated device is {plain(number('kOpenDriverNmmPerCount'))} N mm per count.

**Homing**: the host sends homing (1) in every packet until the device reports 16, 32 and 64. The user pulls the grip out and
then pushes it in; the emulator needs t1 above 40 degrees, then below 18 degrees.

**Calibration**: kerf calibrates when the centre button has been held for 50 ms with the grip at rest. The force starts when the
button is released.
"""


def wooden(root):
    file = Source(root, "shared/wire/woodenhaptics.hpp")
    number = file.number
    home = ", ".join(plain(one) for one in file.numbers("kHomeCounts"))
    bodies = [plain(one) for one in file.numbers("kBodyMm")]
    return f"""## WoodenHaptics

HID reports of 14 bytes, or of 64 bytes of which the first 14 are used: seven i16. The host sends packets of the same length as
the device:

{drawing(file, 'namespace kerf {')}

If the word at 6 is 1, the words at 0 are new counts of d, e, f and not currents. A report is refused if its length differs from the
first report's, or if its word at 12 is not 0 or 1.

**Speaks first**: the host, with currents of 0. From then on the device reports every 1 ms. After {plain(number('kWatchdogS'))} s without a packet from the
host the device switches its amplifiers off.

**Counts to joints**, in rad: angle = 2 pi / {number('kCountsPerRev')} ({plain(number('kCapstanMm'))} / D) count, with D = {', '.join(bodies)} for A, B, C. A turns the
arm to the right. B leans the upper link out from the vertical. C lifts the forearm outwards from straight down. With

    q1 = -A        q2 = pi/2 - B        q3 = C

the [Omni's formulas](#omni) for tip and torques apply, with L1 = {plain(number('kUpperLinkMm'))} mm, L2 = {plain(number('kForearmMm'))} mm, Cy = {plain(number('kShoulderHeightMm') - number('kOriginHeightMm'))}, Cz = {plain(number('kOriginDepthMm'))} mm.

**Torques to motors**: current in mA = torque / torque scale, up to +-{number('kMaxMilliamps')}. The torques of A, B, C are -t1, -t2, t3. A positive
current increases the count. The torque scales of the emulated device are 0.4144, 0.3108, 0.3108 N mm per mA. `encoder_sign` -1
reverses the counts and the motor of a joint.

**Calibration**: the user holds the home pose (A = B = 0, C = pi/2) and presses the button. The word at 12 stays 1 until the host
sets the encoders. kerf sets them to {home}, 0, 0, 0, with zero current. The arm is parked until a joint is more than
40 counts away from these values.
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
                    f"| {'by a button, at any position' if 'has_dock = false' in row else 'in its inkwell'} "
                    f"| ({low}) to ({high}) | {forces[1] if forces else '3.3, 0.88, 0.5'} |")
    if len(rows) != 3:
        raise Lack(f"{kinds.path}: figures of {len(rows)} devices, not 3; tests/docs/reference has to follow")
    table = "\n".join(rows)
    return f"""## Cartesian devices: inverse3, touch, omega

A Cartesian device reports a pose and takes a force through its vendor's service or library. `kerf-arm` translates between the
vendor's interface and the packets below, which are kerf's. The emulator sends and reads these packets directly at
`--front socket` and `udp`.

{drawing(file, 'namespace kerf {')}

The byte at 11 sets the device's light: 0 asks the user to act, 1 the servo is ready, 2 a fault.

The orientation is the tool's: at identity the shaft points up. kerf refuses a packet whose position is more than {number('kFarthestUm') // 1000} mm on an axis,
or whose orientation has a length that differs from 1 by more than 1 %. The force at 28 depends on the sender:

* the emulator sends the force that its motors exert;
* `kerf-arm` sends the force that it passed to the vendor's library in the previous frame, which the device may not have exerted;
* `kerf-arm` for the Inverse3 sends the force that the service reports. Before 3.5 the service reports none, so the force is 0.

The servo rounds each axis of the position to a whole number of counts. The column *parked* shows how the user sets the bit `parked`.

| device | one count of the servo, um | resolution, um | reports orientation | parked | workspace of the emulated device, mm | peak N, continuous N, slew N/ms |
|---|---|---|---|---|---|---|
{table}

**Speaks first**: the device.

**Number**: the number at 4 follows the rules of the Omni's packet counter.

**Force**: the device exerts the force only while the byte at 10 is 1, and clamps the force to its peak.

**Torque scale**: of these devices it is no torque, but the ratio of true force to commanded force along x, y, z. It is 1
for the emulated devices.

**Calibration**: kerf calibrates when the device has been parked, homed and powered for 50 ms and no axis has moved by more than
two steps of its resolution.
"""


def inverse3(root):
    file = Source(root, "shared/wire/inverse3.hpp")
    origin = ", ".join(part.strip() for part in re.search(r"kOriginM\{([^}]*)\}", file.text)[1].split(","))
    device = Source(root, "hil/front/inverse3/service_device.hpp")
    profiles = re.findall(r'"([^"]+)"', re.search(r"kServiceProfileWords\{([^}]*)\}", device.text)[1])
    faults = re.findall(r'"([^"]+)"', re.search(r"kServiceFaultWords\{([^}]*)\}", device.text)[1])
    return f"""## The Inverse3's service

`kerf-arm --device inverse3` talks to the vendor's service, or to the emulator at `--front websocket`: JSON text over a WebSocket at
port {file.number('kServicePort')}, and events at port {file.number('kEventPort')}. Member names are from the vendor's public documentation. The emulated service has the members that kerf
reads, and some others.

* **Speaks first**: the service, with the list of its devices and their configuration. After that it sends exactly one reply to
  each message of the client. In lock-step one message is one period of the servo.
* **Force**, in N: `{{"inverse3": [{{"device_id": "0A1C", "commands": {{"set_cursor_force": {{"vector": {{"x": 0, "y": -0.4, "z": 1.1}}}}}}}}]}}`.
  Before 3.5 the member is `values` instead of `vector`. A force stays until the next message. A message without a force for the
  device sets the force to 0.
* **Frame**, in m: X right, Y away from the user, Z up. kerf's frame has x = X, y = Z, z = -Y and its origin at
  ({origin}) m of the service's frame. The origin is kerf's choice.
* **Emulated versions** (`--profile`): {", ".join(f"`{word}`" for word in profiles)}. `kerf-arm` needs 3.1 or newer and refuses 3.0.
* **HTTP**: `GET /version`, `/devices`, `/settings/devices/force_scale`. The emulator's reply to `/version` has a member
  `kerf_emulator`, from which `kerf-arm` reads whether the emulator runs in lock-step.
* **Faults** of the emulated service (`--bus-fault SECONDS:KIND`). `hil/front/inverse3/service_device.hpp` describes each kind:
  {", ".join(f"`{word}`" for word in faults)}.
"""


def links(root):
    link = Source(root, "shared/wire/emulator_link.hpp")
    devices = re.findall(r'\.word = "(\w+)"', Source(root, "shared/wire/personality.hpp").text)

    def magic(name):
        marks = re.search(rf"{name}\{{([^}}]*)\}}", link.text)[1]
        return " ".join(mark.strip("'") for mark in marks.split(", "))
    return f"""## kerf's own links

The controller (`--port`) and an emulator communicate over a Unix socket of type SOCK_SEQPACKET, or over UDP. **One message is
one packet** of the device as listed above, with no header or trailer. The emulator listens; the controller connects.

1. **Hello.** The controller sends the first hello, and over UDP repeats it every 200 ms until the emulator answers with a
   hello. In lock-step the emulator's hello equals the controller's if device, mode and rate agree. The controller drops
   all packets that the device sends before the answer. If the devices differ, if only one side runs in lock-step, or if
   the rates differ in lock-step, the emulator answers and then ends the link. The emulator also serves a host that sends
   no hello.
2. **First packet.** After the hellos, the side that "speaks first" above sends its packet. An Omni's first report follows the
   emulator's hello.
3. **In real time** each side sends at the rate of its clock and reads the newest packet.
4. **In lock-step** the device sends one packet for each packet of the host: its state one tick later. Each side waits for the
   other, never for a clock. So a device that has no packet for a tick sends a *turn* (see the table) without
   packets. A turn that contains packets means the same as these packets sent one by one. The emulator sends turns only if it
   plays a script of faults. The host sends no turns.
5. **End by the host.** The last packet of the host switches the motors off. Then the host closes the socket, or sends an empty
   datagram over UDP. If the host's first datagram is empty, it has no effect. Over UDP, 2 s without a datagram from the
   host also end the link.
6. **End by the device.** The device calls `shutdown(SHUT_WR)` or `close`, or sends an empty packet; over UDP it sends an empty
   datagram. The controller then reads no more. From the next tick on, each packet that it sends switches the motors off. It
   closes its side 2 s later.

| packet | byte | type | meaning |
|---|---|---|---|
| hello, {link.number('kHelloBytes')} bytes | 0 | u8 x 8 | `{magic('kHelloMagic')}`: letters in ASCII; 0 and 1 are numbers, one byte each; the last byte is the version |
| | 8 | u8 | device: {", ".join(f"{i} {word}" for i, word in enumerate(devices))} |
| | 9 | u8 | 1 in lock-step, else 0 |
| | 12 | u32 | rate of the servo in Hz; from an emulator in real time, the rate of its packets |
| | 10, 11, 16 to 19 | u8 | 0 |
| turn, at most {link.number('kMostBytes')} bytes | 0 | u8 x 8 | `{magic('kMagic')}` |
| | 8 | | for each packet, a u8 with its length, then its bytes |
| target, {link.number('kHandTargetBytes')} bytes | 0 | u8 x 8 | `{magic('kHandTargetMagic')}` |
| | 8 | i32 x 3 | position in um, in the device's frame, each up to {link.number('kMaxTargetMm'):g} mm |
| | 20 | i32 x 3 | yaw, pitch, roll in urad, each up to 60 degrees |
| | 32 | u8 | sum of 1 for button 1, 2 for button 2, 4 for park |
| | 33 | u8 x 3 | 0 |
| greeting, 9 bytes | 0 | u8 x 8 | the same 8 bytes as a target |
| | 8 | u8 | 0: the client leads the hand; 1: another client leads it, and the emulator closes the connection |

A window that leads the emulated hand connects to the emulator's `--hand-socket`, reads the greeting, and sends one target for
each picture that it draws. A hello for an Omni in lock-step at 1000 Hz, in Python with `struct`: `pack("<8s2B2xI4x", b"kerf\\0hi\\1", 0, 1, 1000)`.
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
            rows = struct_table(file, name).replace("state of the run, above", "state of the run ([segment](api.md#the-shared-memory))")
            rows = rows.replace("| u32 | above |", f"| u32 | `{mark}` |", 1)
            yield f"### `{name}`, `{mark}`\n\n{rows}\n"
    kinds = "\n".join(f'    * {value} `{word}`. {comment[0].upper()}{comment[1:]}' for word, value, comment in command.enumerators("CommandKind"))
    replies = ", ".join(f"{value} `{word}` ({comment})" for word, value, comment in command.enumerators("ReplyStatus"))
    hashing = re.search(r"constexpr std::uint64_t block_hash\([^{]*\{(.*?)\n\}", file.text, re.S)[1]
    steps = [line.strip().removesuffix(";").removeprefix("std::uint64_t ") for line in hashing.strip().splitlines()]
    return f"""## Bridge

A WebSocket at `ws://HOST:PORT{path}?token=TOKEN`, protocol {file.number('kProtocol')}; `wss://` unless HOST is the loopback. `kerf-bridge serve` prints host,
port and token.

* The header `Host` must be an IP address, `localhost`, a name of the server's machine, or the name in `--public-url`. Any other
  host gets 421.
* The header `Origin` must be absent, have the scheme and host of the request, or be that of `--public-url`. Any other origin gets 403.
* The reply to a wrong token comes after 1 s. A browser sends a cookie instead of the token.
* Each message is one binary WebSocket message: at most {most_kib} KiB to the viewer, at most {file.number('kMaxUpBytes')} bytes to the server. The magic is the first
  four characters of the message. Times are CLOCK_MONOTONIC of the server.
* A **packed** payload is one LZ4 block (block format, without an LZ4 frame) of `payload_bytes`. It unpacks to `raw_bytes`. In Python:
  `lz4.block.decompress(payload, uncompressed_size=raw_bytes)`. If a payload is not packed, both lengths are equal.
* A **pass** is the changes between two snapshots of the volumes, sent in one or more frames.

The server sends a hello first, and another hello for each new run. After a hello it sends frames, records, replies and views. The
viewer sends an acknowledgement for each frame that it has applied, commands, and its view while it presents. Each message
begins with a head, which has a table below. The head's flags and values, and the data after the head, are:

* hello: a `VolumeDescriptor` ([segment](api.md#the-shared-memory)) for each volume. `off_labels` is 1 if the volume has labels. The
  other offsets are 0. Flags: {file.number('kMayCommand')} this viewer may send commands, {file.number('kTwoArms')} the run has two arms.
* frame: a u64 version for each block, a u32 number for each block, then the payload, which is the blocks. Flags: {file.number('kPacked')} packed,
  {file.number('kLastOfPass')} last of a pass (the viewer then has the volumes of `tick`), {file.number('kRunEnded')} the controller has gone.
  Blocks are numbered from 0: first the scene's text, {file.number('kTextBlockBytes')} bytes a block. The densities follow, volume by volume,
  {file.number('kDensityBlockBytes')} bytes for each brick. The last blocks are the labels of the volumes that have labels, {file.number('kLabelBlockBytes')} bytes for each brick.
  Zeros fill the last block of text.
* records: `count` records of a ring of the segment, with the segment's layout. Record i has the index `first + i * stride`.
  Flag {file.number('kPacked')}: packed. In a run of two arms `ring` is 2 instead of 0: each record is the first arm's record of a tick, followed by the
  second arm's.
* command: `kind` is one of
{kinds}
* view: a viewer with the right to command sends its view up to 60 times a second. The server sends a changed view to all viewers.
  Only one viewer presents at a time; another viewer that tries gets the presenter's view instead. The server ignores a view with
  a number that is not finite or beyond 1e5, a view with `eye_mm` equal to `target_mm`, and a view whose `up` is zero or parallel
  to the direction of view.
* reply: `status` {replies.replace('`kCommandSlots`', str(command.number('kCommandSlots')))}.

`set_hash` is the sum of `block_hash` over all blocks that the viewer has, mod 2^64. `session` is the session of the hello:

    block_hash(id, version, session):
{chr(10).join('        ' + step for step in steps)}

The server closes a connection with one of the codes: {', '.join(f'{value} `{word}`' for word, value, _ in file.enumerators('CloseCode'))}.

{chr(10).join(messages())}"""


def page(root, programs):
    same("shared/wire", ["omni", "falcon", "woodenhaptics", "cartesian", "inverse3", "emulator_link"],
         {path.stem for path in (root / "shared/wire").glob("*.hpp")} - {"little_endian", "personality"})
    return f"""# Wire bytes

All numbers are little-endian. The drivers in `controller/device` and the emulator share these layouts, in `shared/wire`.

From this page you can write a host for the emulator, or a device for the controller. Two examples were written from it:
`examples/python/omni_host.py` and `examples/python/falcon_device.py`.

* The frame of every device is x right, y up, z to the user, in mm.
* A torque scale is the torque of one motor count (WoodenHaptics: of 1 mA), in N mm. The host sets it: `torque_scale` in a scene,
  or `--torque-scale`. `./kerf emulator --personality D --describe` prints the torque scales of the emulated device.

{chr(10).join(part(root) for part in (omni, falcon, wooden, cartesian, inverse3, links, bridge))}"""
