# SPDX-License-Identifier: Apache-2.0
"""Each of many random edits of a recording is found, or has no effect.

    edits_test.py ROOT BIN [EDITS [SEED]]"""
import random
import re
import shutil
import sys
import unittest

from recordings import HEADER, ROW, Recordings, check, figures

EDITS = int(sys.argv.pop(1)) if len(sys.argv) > 1 else 200
SEED = int(sys.argv.pop(1)) if len(sys.argv) > 1 else 68


class TestEdits(Recordings):
    def edit(self, log, dice):
        """Changes one file of a log somehow; returns how."""
        files = sorted(path for path in log.rglob("*") if path.is_file())
        path = dice.choice(files)
        data = bytearray(path.read_bytes())
        how = dice.choice(["bit", "byte", "cut", "double", "swap", "drop", "append", "number", "files", "gone"])
        at = dice.randrange(len(data))
        size = dice.choice([1, 4, 8, ROW, dice.randrange(1, 3000)])
        at = HEADER + (at - HEADER) // ROW * ROW if size == ROW and path.suffix == ".npy" and at > HEADER else at
        if how == "bit":
            data[at] ^= 1 << dice.randrange(8)
        elif how == "byte":
            data[at] = dice.randrange(256)
        elif how == "cut":
            del data[at:]
        elif how == "double":
            data[at:at] = data[at:at + size]
        elif how == "swap":
            data[at:at + 2 * size] = data[at + size:at + 2 * size] + data[at:at + size]
        elif how == "drop":
            del data[at:at + size]
        elif how == "append":
            data += data[at:at + size]
        elif how == "number":
            numbers = list(re.finditer(rb"\d+", data)) if path.suffix == ".json" else []
            if numbers:
                number = dice.choice(numbers)
                data[number.start():number.end()] = str(dice.choice([0, 9, 10**23, int(number[0]) + 1])).encode()
        elif how == "files":
            other = dice.choice(files)
            data, _ = bytearray(other.read_bytes()), other.write_bytes(data)
        if how == "gone":
            path.unlink()
        else:
            path.write_bytes(data)
        return f"{path.relative_to(log)}: {how} at {at}, {size}"

    def test_each_of_many_random_edits_is_found_or_has_no_effect(self):
        dice = random.Random(SEED)
        was = {log: figures(log) for log in (self.log, self.flight, self.split)}
        found = 0
        for number in range(EDITS):
            of = dice.choice(list(was))
            log = self.copy(of)
            how = self.edit(log, dice)
            code, said, wrong = check(log)
            with self.subTest(number=number, how=how, said=said + wrong):
                if code == 0:
                    self.assertEqual(figures(log), was[of])
                    continue
                found += 1
                # Each line has a place, a value and a way out.
                self.assertTrue(wrong and all(re.match(r"kerf-record: .+: .+; .+", line) for line in wrong.splitlines()), wrong)
            shutil.rmtree(log.parent)
        self.assertGreater(found, 0.8 * EDITS)


if __name__ == "__main__":
    unittest.main()
