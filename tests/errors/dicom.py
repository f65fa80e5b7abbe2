# SPDX-License-Identifier: Apache-2.0
"""dicom.py FOLDER SERIES [SLOPE [COUNT]]: three slices of 4x4 voxels of 1 mm, explicit little endian, as one series."""
import pathlib
import struct
import sys


def element(group, number, kind, value):
    value = value.encode() if isinstance(value, str) else value
    value += (b'\0' if kind in (b'UI', b'OW') else b' ') * (len(value) % 2)
    length = struct.pack('<HI', 0, len(value)) if kind in (b'OW', b'OB') else struct.pack('<H', len(value))
    return struct.pack('<HH', group, number) + kind + length + value


def write_series(folder, series, slices, edge_mm='1', slope='1'):
    """One file for each of `slices`, rows of whole numbers from 0 to 65535, in a folder that is made."""
    folder.mkdir(exist_ok=True)
    whole = struct.Struct('<H').pack
    for i, rows in enumerate(slices):
        image = f'1.2.3.{series}.{i}'
        meta = (element(2, 1, b'OB', b'\0\1') + element(2, 2, b'UI', '1.2.840.10008.5.1.4.1.1.2')
                + element(2, 3, b'UI', image) + element(2, 0x10, b'UI', '1.2.840.10008.1.2.1'))
        body = b''.join(element(*e) for e in [
            (8, 0x16, b'UI', '1.2.840.10008.5.1.4.1.1.2'), (8, 0x18, b'UI', image), (8, 0x60, b'CS', 'CT'),
            (8, 0x103e, b'LO', f'series {series}'), (0x20, 0xe, b'UI', f'1.2.3.{series}'), (0x20, 0x11, b'IS', series),
            (0x20, 0x13, b'IS', str(i + 1)), (0x20, 0x32, b'DS', f'0\\0\\{i * float(edge_mm):g}'),
            (0x20, 0x37, b'DS', '1\\0\\0\\0\\1\\0'), (0x28, 2, b'US', whole(1)), (0x28, 4, b'CS', 'MONOCHROME2'),
            (0x28, 0x10, b'US', whole(len(rows))), (0x28, 0x11, b'US', whole(len(rows[0]))),
            (0x28, 0x30, b'DS', f'{edge_mm}\\{edge_mm}'), (0x28, 0x100, b'US', whole(16)),
            (0x28, 0x101, b'US', whole(16)), (0x28, 0x102, b'US', whole(15)), (0x28, 0x103, b'US', whole(0)),
            (0x28, 0x1052, b'DS', '0'), (0x28, 0x1053, b'DS', slope),
            (0x7fe0, 0x10, b'OW', b''.join(whole(value) for row in rows for value in row))])
        size = element(2, 0, b'UL', struct.pack('<I', len(meta)))
        (folder / f'{series}-{i}.dcm').write_bytes(bytes(128) + b'DICM' + size + meta + body)


if __name__ == '__main__':
    count = int(sys.argv[4]) if len(sys.argv) > 4 else 3
    small = [[[100 * i + 4 * j + k for k in range(4)] for j in range(4)] for i in range(count)]
    write_series(pathlib.Path(sys.argv[1]), sys.argv[2], small, slope=sys.argv[3] if len(sys.argv) > 3 else '1')
