# SPDX-License-Identifier: Apache-2.0
"""dicom.py FOLDER SERIES [SLOPE]: three slices of 4x4 voxels of 1 mm, explicit little endian, as one series."""
import pathlib
import struct
import sys


def element(group, number, kind, value):
    value = value.encode() if isinstance(value, str) else value
    value += (b'\0' if kind in (b'UI', b'OW') else b' ') * (len(value) % 2)
    length = struct.pack('<HI', 0, len(value)) if kind in (b'OW', b'OB') else struct.pack('<H', len(value))
    return struct.pack('<HH', group, number) + kind + length + value


folder, series = pathlib.Path(sys.argv[1]), sys.argv[2]
slope = sys.argv[3] if len(sys.argv) > 3 else '1'
folder.mkdir(exist_ok=True)
whole = struct.Struct('<H').pack
for i in range(3):
    image = f'1.2.3.{series}.{i}'
    meta = (element(2, 1, b'OB', b'\0\1') + element(2, 2, b'UI', '1.2.840.10008.5.1.4.1.1.2')
            + element(2, 3, b'UI', image) + element(2, 0x10, b'UI', '1.2.840.10008.1.2.1'))
    body = b''.join(element(*e) for e in [
        (8, 0x16, b'UI', '1.2.840.10008.5.1.4.1.1.2'), (8, 0x18, b'UI', image), (8, 0x60, b'CS', 'CT'),
        (8, 0x103e, b'LO', f'series {series}'), (0x20, 0xe, b'UI', f'1.2.3.{series}'), (0x20, 0x11, b'IS', series),
        (0x20, 0x13, b'IS', str(i + 1)), (0x20, 0x32, b'DS', f'0\\0\\{i}'), (0x20, 0x37, b'DS', '1\\0\\0\\0\\1\\0'),
        (0x28, 2, b'US', whole(1)), (0x28, 4, b'CS', 'MONOCHROME2'), (0x28, 0x10, b'US', whole(4)),
        (0x28, 0x11, b'US', whole(4)), (0x28, 0x30, b'DS', '1\\1'), (0x28, 0x100, b'US', whole(16)),
        (0x28, 0x101, b'US', whole(16)), (0x28, 0x102, b'US', whole(15)), (0x28, 0x103, b'US', whole(0)),
        (0x28, 0x1052, b'DS', '0'), (0x28, 0x1053, b'DS', slope),
        (0x7fe0, 0x10, b'OW', b''.join(whole(100 * i + n) for n in range(16)))])
    size = element(2, 0, b'UL', struct.pack('<I', len(meta)))
    (folder / f'{series}-{i}.dcm').write_bytes(bytes(128) + b'DICM' + size + meta + body)
