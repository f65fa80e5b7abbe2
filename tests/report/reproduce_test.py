#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Rows of published numbers (lab/report/reproduce.py):  reproduce_test.py ROOT KERF-LAB"""
import importlib.util
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

ROOT, LAB = pathlib.Path(sys.argv[1]), sys.argv[2]
sys.path.insert(0, str(ROOT / "lab/report"))
sys.dont_write_bytecode = True
import reproduce  # noqa: E402
import text  # noqa: E402

CAN_PLOT = importlib.util.find_spec("matplotlib") is not None
SOURCE = '[[source]]\nname = "a"\ncite = "A. Author: A title, 2026"\nseen = "all"\n'
ROW = {"source": '"a"', "place": '"table 1"', "group": '"Walls"', "what": '"highest passive K"', "published": "200", "unit": '"N/m"',
       "function": '"passive_stiffness"', "parameters": '{ loop = "ideal", viscous = 0.0001, damping = 0, delay = 0 }',
       "compare": '"within 1 %"', "held": '"b, T"'}
# These take a second or two and have all kinds of numbers: theory, runs in time, a plane of cells, contacts, cuts, tables.
QUICK = ["colgate-schenkel", "course-p3", "touch-config", "gil-2009", "diolaiti", "cutting-2016", "crown-forces"]


def file_of(sources=SOURCE, head="", **changes):
    row = {**ROW, **changes}
    return head + sources + "\n[[row]]\n" + "".join(f"{key} = {value}\n" for key, value in row.items() if value)


def lab(*words, given=None):
    made = subprocess.run([LAB, "reproduce", *words], input=given, capture_output=True, text=True, check=False)
    return made.returncode, made.stdout, made.stderr


class Reproduce(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.rows = self.folder / "mine.toml"

    def measured(self, content):
        self.rows.write_text(content, encoding="utf-8")
        report = self.folder / "report.json"
        code, out, err = lab("--rows", str(self.rows), "--report", str(report))
        self.assertEqual(err, "")
        return code, out, json.loads(report.read_text(encoding="utf-8"))

    def refusal(self, content):
        self.rows.write_text(content, encoding="utf-8")
        with self.assertRaises(text.BadInput) as caught:
            reproduce.load(str(self.rows))
        complaint = str(caught.exception)
        self.assertNotIn("\n", complaint)
        self.assertTrue(complaint.startswith(f"{self.rows}: "), complaint)
        self.assertIn("; ", complaint)  # the way out
        return complaint.removeprefix(f"{self.rows}: ")

    def test_a_row_that_holds_is_a_match(self):
        code, out, report = self.measured(file_of())
        self.assertEqual((code, report["rows"][0]["verdict"], report["unexplained"]), (0, "match", 0))
        self.assertIn("| highest passive K [a: table 1] | 200 N/m | 200 N/m | 0.0 % | match (within 1 %) | b, T |", out)

    def test_a_row_that_is_broken_on_purpose_is_a_miss(self):
        for broken in ({"published": "190"}, {"parameters": '{ loop = "ideal", viscous = 0.00011, damping = 0, delay = 0 }'}):
            code, out, report = self.measured(file_of(**broken))
            self.assertEqual((code, report["rows"][0]["verdict"], report["unexplained"]), (1, "miss", 1))
            self.assertIn("| **miss** |", out)
            self.assertIn("Not explained.", reproduce.misses(report))
        code, _, report = self.measured(file_of(published="190", why='"another device"'))
        self.assertEqual((code, report["rows"][0]["verdict"], report["unexplained"]), (0, "miss", 0))
        self.assertIn("190 N/m published, 200 N/m here. another device", reproduce.misses(report))

    def test_each_way_to_compare_has_its_verdict(self):
        for compare, published, value, verdict in [
                ("within 5 %", 100, 104, "match"), ("within 5 %", 100, 106, "miss"), ("within a factor of 2", 1, 1.9, "match"),
                ("within a factor of 2", 1, 0.4, "miss"), ("within a factor of 2", -1, 1, "miss"), ("within 0.1", 0, -0.05, "match"),
                ("within 0.1", 0, 0.2, "miss"), ("at least", 1, 1, "match"), ("at least", 1, 0.9, "miss"), ("at most", 1, 2, "miss"),
                ("at most", 1, float("inf"), "miss"), ("shown", 1, 9, "shown"), ("equal", "rests", "rests", "match"),
                ("equal", "rests", "swings", "miss")]:
            self.assertEqual(reproduce.verdict_of({"compare": compare, "published": published}, value), verdict, (compare, value))

    def test_units_are_converted_and_must_fit(self):
        _, _, report = self.measured(file_of(published="0.2", unit='"N/mm"'))
        self.assertEqual(report["rows"][0]["verdict"], "match")
        self.assertIn("gives N/mm; take its kind of unit", self.refusal(file_of(unit='"kg"')))

    def test_a_bad_row_gives_one_line_with_file_place_and_way_out(self):
        row = "row 1 (highest passive K): "
        for changes, complaint in [
                ({"unit": ""}, row + "no unit; give it: one of N/mm, "), ({"unit": '"furlong"'}, row + "unit: furlong: unknown; take one of N/mm"),
                ({"function": '"passive"'}, row + "function: passive: unknown; there are "),
                ({"source": '"b"'}, row + "source: b: no [[source]] has this name; add one"),
                ({"source": ""}, row + "no source; give it"), ({"published": '"200"'}, row + "published: 200: is no number"),
                ({"published": "true"}, row + "published: True: is no number"),
                ({"published": "nan"}, row + "published: nan: is not finite"), ({"published": "-inf"}, row + "published: -inf: is not finite"),
                ({"compare": '"within . %"'}, row + "compare: within . %: unknown"),
                ({"compare": '"within a factor of 1.2.3"'}, row + "compare: within a factor of 1.2.3: unknown"),
                ({"compare": '"within a factor of 0"'}, row + "compare: within a factor of 0: no number is within it"),
                ({"compare": '"about"'}, row + "compare: about: unknown; give within N %"),
                ({"compare": '"equal"'}, row + "compare: equal: texts are equal or not"),
                ({"unknown": '"mass"'}, row + "compare: within 1 %: a source that leaves mass out"),
                ({"held": "3"}, row + "held: is no text; write some"), ({"when": '"now"'}, row + "when: unknown; it may have "),
                ({"parameters": "7"}, row + "parameters: is no table"),
                ({"function": '"ratio"', "unit": '"1"', "parameters": "{ of = 1 }"}, row + "parameters: missing a required argument"),
                ({"function": '"ratio"', "unit": '"1"', "parameters": '{ of = "x", axis = "rate", values = [1, 2] }'},
                 row + "parameters: of: x: no function"),
                ({"source": '"a"', "source_of": '"a"'}, row + "source_of: unknown")]:
            self.assertTrue(self.refusal(file_of(**changes)).startswith(complaint), (complaint, self.refusal(file_of(**changes))))
        self.assertIn("source 1 (a): no cite; give it", self.refusal(file_of(SOURCE.replace("cite", "site"))))
        self.assertIn("source 2 (a): is given twice", self.refusal(file_of(SOURCE + SOURCE)))
        self.assertIn("[[row]]: none; give at least one", self.refusal(SOURCE))
        self.assertIn("rows: unknown; a file has", self.refusal("rows = 1\n" + SOURCE))
        self.assertIn("row: is no list of tables", self.refusal("row = 1\n" + SOURCE))
        self.assertIn("no TOML: ", self.refusal("[[row]\n"))
        self.assertIn("is no regular file of at most 1 MiB", self.refusal("# " + "x" * (1 << 20)))
        for path in ("/dev/zero", str(self.folder)):  # neither is read: one has no end
            with self.assertRaisesRegex(text.BadInput, f"{path}: is no regular file of at most 1 MiB; name a file of rows"):
                reproduce.load(path)

    def test_errors_of_the_command_have_one_line(self):
        self.rows.write_text(file_of(), encoding="utf-8")
        for words, complaint in [
                (["--rows", str(self.folder / "none.toml")], "none.toml: No such file or directory; name a file of rows"),
                (["--only", "nobody"], "--only: nobody: no source of "), (["--rows", str(self.rows), "--page", "p.md"], "--page: is of all rows"),
                (["--rows", str(self.rows), "--page", str(self.folder / "p.md")], "--page: is of all rows"),
                (["--probe", "devices", "--only", "a"], "--probe: measures one thing")]:
            code, out, err = lab(*words)
            self.assertEqual((code, out, err.count("\n")), (2, "", 1), words)
            self.assertIn(complaint, err)
        rows = self.folder / "rows.json"
        rows.write_text(file_of(), encoding="utf-8")
        code, _, err = lab("--rows", str(rows), "--report", str(rows))
        self.assertEqual((code, rows.read_text(encoding="utf-8")), (2, file_of()))
        self.assertIn("rows.json: is a file of this run itself, which would be lost; give --report another name", err)
        self.assertFalse((self.folder / "plots").exists())  # a page that is refused makes none
        with open("/dev/zero", encoding="utf-8") as endless:
            made = subprocess.run([LAB, "reproduce", "--probe", "contact"], stdin=endless, capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual((made.returncode, made.stdout, made.stderr.count("\n")), (2, "", 1))
        self.assertIn("--probe: the standard input has more than 64 KiB; give such as ", made.stderr)
        for name, given, complaint in [
                ("contact", "[", "is no JSON object"), ("contact", '{"mass": 1}', "mass: unknown; known: mass_kg, "),
                ("contact", '{"mass_kg": 0}', "mass_kg: 0 is outside of 0.001 to 100"), ("contact", '{"mass_kg": "1"}', "mass_kg: is no number"),
                ("contact", '{"seconds": 600, "rate_hz": 100000}', "more than two million ticks"),
                ("cut", '{"settings": 1}', "give settings as a list of texts"), ("cut", '{"settings": ["cut.no=1"]}', "no")]:
            code, out, err = lab("--probe", name, given=given)
            self.assertEqual((code, out, err.count("\n")), (2, "", 1), (name, given, err))
            self.assertIn(complaint, err)
        self.rows.write_text(file_of(parameters='{ loop = "fast" }'), encoding="utf-8")
        code, _, err = lab("--rows", str(self.rows))
        self.assertEqual(code, 2)
        self.assertIn(f"{self.rows}: row (highest passive K): kerf-lab: --loop: fast is unknown", err)
        self.assertEqual(err.count("\n"), 1)

    def test_a_row_of_a_reader_needs_one_entry_and_one_function(self):
        (self.folder / "mine.py").write_text(
            "from reproduce_rows import gives, linear_stiffness\n\n\n@gives('N/mm')\ndef half_of_it(kerf, **axes):\n"
            "    return linear_stiffness(kerf, **axes) / 2\n", encoding="utf-8")
        code, _, report = self.measured(file_of(head='functions = "mine.py"\n\n', function='"half_of_it"', published="100"))
        self.assertEqual((code, report["rows"][0]["verdict"]), (0, "match"))
        self.assertIn("mine.py: ", str(self.refusal_of_functions()))

    def test_functions_of_a_reader_that_fail_have_one_line(self):
        for name, content, complaint in [
                ("mine.py", "1 / 0\n", "mine.py: ZeroDivisionError: "), ("mine.py", "import no_such\n", "mine.py: ModuleNotFoundError: "),
                ("mine.py", "raise SystemExit(0)\n", "mine.py: SystemExit: 0; correct it"), ("mine.toml", "", "mine.toml: is no Python file"),
                ("", "", ": is no Python file; "), ("mine.py", "def own(kerf):\n    return 1\n\nown.unit = 'furlong'\n", "gives furlong, an unknown unit"),
                ("mine.py", "def own(kerf):\n    raise SystemExit(0)\n\nown.unit = 'N/m'\n", "own: SystemExit 0; correct"),
                ("mine.py", "def own(kerf):\n    return kerf.no\n\nown.unit = 'N/m'\n", "own: AttributeError ")]:
            if content:
                (self.folder / name).write_text(content, encoding="utf-8")
            self.rows.write_text(file_of(head=f'functions = "{name}"\n\n', function='"own"', parameters=""), encoding="utf-8")
            code, out, err = lab("--rows", str(self.rows))
            self.assertEqual((code, out, err.count("\n")), (2, "", 1), (content, err))
            self.assertIn(complaint, err)
        # What one prints is no part of the table, nor of the report.
        (self.folder / "mine.py").write_text("print('begins')\n\ndef own(kerf):\n    print('runs')\n    return 200\n\nown.unit = 'N/m'\n", encoding="utf-8")
        self.rows.write_text(file_of(head='functions = "mine.py"\n\n', function='"own"', parameters=""), encoding="utf-8")
        code, out, _ = lab("--rows", str(self.rows))
        self.assertEqual((code, "match (within 1 %)" in out, "runs" in out), (0, True, False))

    def refusal_of_functions(self):
        (self.folder / "mine.py").write_text("def (:\n", encoding="utf-8")
        with self.assertRaises(text.BadInput) as caught:
            reproduce.load(str(self.rows))
        return caught.exception

    def test_a_loop_below_250_hz_is_the_same_loop_with_time_stretched(self):
        kerf = reproduce.Kerf({"program": LAB, "jobs": 1})
        loop = {"mass": 0.2, "viscous": 0.002, "damping": 0.001, "delay": 1, **reproduce.reproduce_rows.PAPERS}
        fast = kerf.column([0.1, 0.2], rate=500, seeds=1, friction=0.1, quantum=0.01, push=1, hit=100, start=1, **loop)
        # All of it twice as slow: masses x 4, dampings x 2, speeds / 2, and the same stiffness.
        slow = {**loop, "mass": 0.8, "viscous": 0.004, "damping": 0.002}
        slow = kerf.column([0.1, 0.2], rate=250, seeds=1, friction=0.1, quantum=0.01, push=1, hit=50, start=1, **slow)
        same = reproduce.slowed({"mass": 0.8 * 4, "viscous": 0.008, "rate": 125}, 0.5)
        self.assertEqual((same["mass"], same["viscous"], same["rate"]), (0.8, 0.004, 250))
        self.assertAlmostEqual(fast["analytic"]["exact_n_per_mm"], slow["analytic"]["exact_n_per_mm"], 9)
        self.assertEqual(fast["by_travel"]["first_n_per_mm"], slow["by_travel"]["first_n_per_mm"])
        with self.assertRaisesRegex(text.BadInput, "hand cannot be scaled"):
            reproduce.slowed({"hand": "firm"}, 0.5)

    def test_the_page_has_what_it_promises(self):
        sources, rows, _ = reproduce.load(str(reproduce.ROWS))
        self.assertGreaterEqual(len(sources), 12)
        self.assertGreaterEqual(len(rows), 60)
        self.assertEqual(set(sources), {row["source"] for row in rows})
        page = (ROOT / "docs/reality.md").read_text(encoding="utf-8")
        self.assertNotIn("Not explained.", page)
        for row in rows:
            self.assertIn(f"| {row['what']} [{row['source']}: {row['place']}] | ", page)
        table = re.findall(r"^\| .* \| (\*\*miss\*\*|shown|match \(.*?\)) \| ", page, re.MULTILINE)
        self.assertEqual(len(table), len(rows))
        self.assertEqual(table.count("**miss**"), page.split("## The misses")[1].split("\n## ")[0].count("\n* *"))

    def test_the_numbers_of_the_page_come_again(self):
        page = (ROOT / "docs/reality.md").read_text(encoding="utf-8").splitlines()
        report = self.folder / "report.json"
        code, out, err = lab("--only", ",".join(QUICK), "--report", str(report))
        self.assertEqual((code, err), (0, ""))
        lines = [line for line in out.splitlines() if line.startswith("| ")]
        self.assertGreater(len(lines), 35)
        for line in lines:
            self.assertIn(line, page)
        again = lab("--only", ",".join(QUICK), "--jobs", "1")
        self.assertEqual(again, (0, out, ""))

    @unittest.skipUnless(CAN_PLOT, "no matplotlib")
    def test_plots_are_svg(self):
        plane = {"beta": [0.4, 0.6], "sigma": [0.4, 0.6],
                 "cells": [{"beta": b, "sigma": s, "light": "rests", "hard": "swings"} for b in (0.4, 0.6) for s in (0.4, 0.6)]}
        curve = {"label": "alone", "s": [0, 1], "port_mj": [0, -100], "observed_mj": [0, -1]}
        data = {"regions": plane, "energy": {"panels": [{"title": "a wall", "curves": [curve, curve]}]}}
        for plot, part in ((reproduce.regions, "settles after the push only"), (reproduce.energy, "energy taken by the port (mJ)")):
            picture = plot(data)
            self.assertEqual(xml.fromstring(picture).tag, "{http://www.w3.org/2000/svg}svg")
            self.assertIn(part, picture)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
