#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Pages and plots of lab/report, from the JSON of a short run of kerf-lab where there is one, else from a few made-up rows:

    report_test.py REPOSITORY KERF-LAB"""
import importlib.util
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml
from unittest import mock

ROOT, LAB = pathlib.Path(sys.argv[1]), sys.argv[2]
TOOL = ROOT / "lab/report"
sys.path.insert(0, str(TOOL))


def load_tool():
    spec = importlib.util.spec_from_file_location("tool", TOOL / "__main__.py")
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    return tool


tool = load_tool()
CAN_PLOT = importlib.util.find_spec("matplotlib") is not None
if not CAN_PLOT and os.path.realpath(sys.executable) != os.path.realpath(tool.DEBIAN) and os.path.exists(tool.DEBIAN):
    os.execv(tool.DEBIAN, [tool.DEBIAN, "-B", *sys.argv])


def run(words, data):
    """Output of the tool. Throws tool.BadInput."""
    with mock.patch.object(sys, "stdin", io.StringIO(data if isinstance(data, str) else json.dumps(data))):
        return tool.run(words)


def run_alone(words, data):
    """Exit code, output and complaint of the tool as a process."""
    done = subprocess.run([sys.executable, "-B", TOOL, *words], input=json.dumps(data), capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def lab(*words):
    """The JSON of a map of kerf-lab."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([LAB, *words, "--json", f"{folder}/a.json"], stdout=subprocess.DEVNULL, check=True)
        return json.loads(pathlib.Path(f"{folder}/a.json").read_text(encoding="utf-8"))


def curve(name, values):
    return {"name": name, "s": [0, 1, 2], "values": values}


RECORDING = {"end_s": 2.5, "sources": [curve("spring", [0, 1, 2]), curve("leak", [0, -1, -1])],
             "curves": [curve(name, [0, 1, 0.5]) for name in
                        ("contact", "modification", "commanded", "penetration", "removed", "port")]}

KERNEL = {"name": "contact/ball16/any", "numeric": "fixed", "isa": "avx2", "ns_p50": 2000, "ns_p99": 2500, "ratio": 15,
          "bytes": 1234}
KERNELS = {"provenance": "a day, a machine.", "rows": [KERNEL], "queries": [KERNEL], "layout": [KERNEL]}


ENERGY = {"provenance": "a day, a machine.", "cost": [{"name": "ledger", "numeric": "fixed", "ns": 123.4}],
          "loops": [{"model": "paper", "numeric": "fixed", "share": 0.0012, "most_share": 0.01, "friction_mj": 0.5,
                     "leak_mj": -0.001}],
          "feel": [{"hand": "bare", "stiffness_n_per_mm": 2, "stabiliser": "none", "peak_n": 1.5, "delay_ms": 30,
                    "depth_mm": 0.5, "swing_mm": 0.01, "drag_n": 0, "port_minimum_mj": -0.1}]}


def picture(renderer, tool, partial, wall_ms):
    return {"renderer": renderer, "gradient": "adaptive", "volume": "256x256x161", "tool": tool, "cropped": False,
            "partial": partial, "fps": 1000 / wall_ms, "cpu_ms": 2 * wall_ms}


PICTURES = {"day": "a day", "processor": "a processor", "gl_renderer": "a driver", "cores": 2, "cast_set": "avx2", "width": 512, "height": 512,
            "rows": [picture("iso", 0, False, 50), picture("iso", 16, False, 40), picture("iso", 16, True, 4),
                     picture("cast", 0, False, 8)],
            "gradients": [{"gradient": "adaptive", "angle_deg": 0.5, "noisy_angle_deg": 1.25, "p99_deg": 1, "milled_angle_deg": 2,
                           "milled_p99_deg": 3, "thick_2_p99_deg": 3.5, "thick_5_p99_deg": 4, "thick_10_p99_deg": 5}]}

WALL = {"name": "a wall", "paper_most_n": 0.5, "paper_unfelt_mm": 1,
        "presses": {"depth_mm": [0, 1], "paper_n": [0, 0.5], "proxy_n": [0, 1]},
        "losses": {"rate_hz": [100, 1000], "paper_mm_per_s": [50, None], "proxy_mm_per_s": [None, None]}}
CONTACT = {"provenance": "a day, a machine.",
           "rows": [{"group": "walls", "name": "a wall", "value": 1, "unit": "mm", "limit": 2, "aim": None, "pass": True,
                     "skipped": ""},
                    {"group": "walls", "name": "a worse wall", "value": 3, "unit": "mm", "limit": 2, "aim": 1, "pass": False,
                     "skipped": ""},
                    {"group": "cutting", "name": "a tooth", "value": None, "unit": "%", "limit": 2, "aim": 1.5, "pass": True,
                     "skipped": "no --data"}],
           "comparison": {"walls": [WALL, WALL],
                          "slide": {"paper_step": 0.01, "proxy_step": 0.02, "paper_degrees": 1, "proxy_degrees": 2,
                                    "ticks": {"travel_mm": [0, 1], "paper": [1, 1], "proxy": [1, 1.01]}}},
           "hands": [{"name": "touch", "ticks": {"s": [0, 1], "height_mm": [1, 0], "proxy_height_mm": [1, 0.5],
                                                 "force_n": [0, 1], "removed_mm3": [0, 2]}}]}


def accuracy_rows():
    """Every choice that the page speaks of, with every metric."""
    import accuracy
    names = {found[1] for found in re.finditer(r"\{([^{}|]+)\|", accuracy.ADVICE)} | {"0.125 mm"}
    metrics = {column[1:4:2] for _, _, columns in accuracy.TABLES for column in columns}
    metrics |= {(metric, shape) for metric in ("force_vs_theory_rms", "force_vs_theory_max") for shape in accuracy.SHAPES}
    proxy = {(column[1], shape) for column in accuracy.PROXY_COLUMNS for shape in (column[3], *accuracy.SHAPES)}
    choices = [("kernel", name, name == "Q15", metrics) for name in sorted(names)]
    choices += [(knob, value, value == "0.125 mm", proxy) for knob, _ in accuracy.PROXY_KNOBS for value in ("0.125 mm", "finer")]
    return [{"knob": knob, "value": name, "standard": standard, "plain": name == "Q8", "shape": shape,
             "metric": metric, "figure": 0.01 * (place + 1), "unit": "1", "us_p50": 1 + place, "us_p99": 2 + place}
            for place, (knob, name, standard, its) in enumerate(choices) for metric, shape in sorted(its)]


ACCURACY = {"provenance": "a day, a machine.", "rows": accuracy_rows()}

MAP = lab("zwidth", "--damping", "0:0.03:3", "--rate", "500,1000", "--stiffness", "0.05:50:6", "--seeds", "1")
HEIGHTS = lab("zwidth", "--map", "numeric,rate", "--numeric", "fixed,double", "--rate", "500,1000", "--damping", "0.002",
              "--stiffness", "0.05:50:5", "--seeds", "1")
FELT = lab("impedance", "--frequency", "1:250:5")
PORTRAITS = {"seed": 1, "seconds": 1, "whole_arm": False, "axes": MAP["columns"][0]["axes"],
             "cells": [{"stiffness_n_per_mm": 1, "damping_ns_per_mm": 0.002,
                        "hits": [{"name": "push", "tip_mm": [0, -1], "mm_per_s": [0, 1]}]}]}
STABILITY = {"highest_n_per_mm": 50, "provenance": "a day, a machine.", "devices": MAP, "rates": MAP,
             "table": [{"device": "Omni", "delay": "1", "damping": "0.002", "exact": 1.59, "axis": 2.4, "held": 3,
                        "arm": float("inf"), "checked": 0.552}],
             "stabilisers": [{"device": "Omni", "delay": "1", "lowest": {"none": [2.4, 0]}}],
             "knobs": [{"name": "rate", "unit": "Hz", "value": "1000", "standard": True, "swings": 2.4, "active": 2.4,
                        "exact": 1.59, "re_entry": 0}],
             "question": {"zwidth": ["$ ./kerf lab zwidth --device a.toml"], "impedance": ["$ ./kerf lab impedance"],
                          "stiffness": "0.69", "damping": "0.002", "felt": FELT["rows"]},
             "numbers": [{"numeric": "fixed", "cells": 600, "others": 19, "columns": 2, "factor": 2.67}]}
BURS = {"out_mm": 8, "heads": [{"number": "001", "name": "round", "sizes": [
    {"tenths": 10, "neck_mm": 0.3, "length_mm": 1, "outline": [[0, 0], [0.5, 0.5], [0, 1]]}]}]}

# Subject and kind, input, further words, what the output has, and a list that must not be empty.
PAGES = [
    (("kernels", "page"), KERNELS, [], ["| contact/ball16/any | fixed | avx2 | 2.00 | 2.50 | 15 | 1234 |\n",
                                        "./kerf bench kernels --page docs/performance.md", "a day, a machine."], "rows"),
    (("energy", "page"), ENERGY, [], ["| paper | fixed | 0.0012 | 0.01 | 0.5000 | -0.00100 |", "| ledger | fixed | 123 |",
                                      "| bare | 2 | none | 1.50 | 30 | 0.50 | 0.010 | 0.00 | -0.100 |"], "loops"),
    (("energy", "tables"), ENERGY, [], ["## The time they take"], "loops"),
    (("pictures", "page"), PICTURES, [], ["| iso | 256x256x161 | 20.0 | - | 25.0 | - | 250 | 100 | 80.0 | 8.0 | GPU iso 6 / 6 |",
                                          "| adaptive | 0.50 | 1.00 | 1.25 | 2.00 | 3.00 | 3.50 | 4.00 | 5.00 | 100 | 80.0 | 8.0 |", "gl: a driver; cast: `avx2`."], "rows"),
    (("pictures", "tables"), PICTURES, [], ["| cast | 256x256x161 | 125 | - | - | - | - | 16.0 | - | - | - |"], "rows"),
    (("contact", "page"), CONTACT, ["a.svg", "b.svg"],
     ["Of 2 limits 1 are kept; missed are", "* walls, a worse wall: 3 mm instead of 2", "(a.svg)", "(b.svg)",
      "| a tooth |  |  | 2 | 1.5 | skipped: no --data |", "| 100 Hz | 50 mm/s | 50 mm/s | never |"], "rows"),
    (("accuracy", "page"), ACCURACY, ["a.svg"], ["](a.svg)", "| **Q15** | ", "| Q8 | ("], "rows"),
    (("stability", "page"), STABILITY, ["a.svg", "b.svg"],
     ["](a.svg)", "| Omni | 1 | 0.002 | 1.59 | 2.4 | 3 | > 50 | 1 | **0.55** |", "| Omni | 1 | 2.4 / < 0.05 |",
      "| rate, Hz | **1000** | 2.4 | 2.4 | 1.59 | - |", "* fixed point and double: 19 of 600 cells",
      "    $ ./kerf lab zwidth --device a.toml", "So this device may render 0.69 N/mm", "At 15.8 Hz a hand feels 1.08 N/mm"], "table"),
]
PLOTS = [
    (("recording", "forces"), RECORDING, [], [">contact<", ">leak<", "removed (mm³)", "work of the hand (mJ)"], "curves"),
    (("burs", "sheet"), BURS, [], [">round<", ">010<"], "heads"),
    (("contact", "plot"), CONTACT, [], ["slow press into a wall", "proxy: not up to here"], "comparison"),
    (("contact", "hands"), CONTACT, [], ["touch: force (N)", "touch: removed (mm³)"], "hands"),
    (("accuracy", "plot"), ACCURACY, [], ["force against theory", ">front<"], "rows"),
    (("impedance", "plot"), FELT, [], ["damping as felt (N s/mm)", "device and wall, measured"], "rows"),
    (("stability_map", "map"), MAP, [], ["rate 500 Hz", "stiffness of the wall, K (N/mm)", "settles: proven"], "columns"),
    (("stability_map", "map"), HEIGHTS, [], ["highest stiffness, by the stricter rule (N/mm)"], "columns"),
    (("stability_map", "portraits"), PORTRAITS, [], ["K 1 N/mm, B 0.002 N s/mm", ">push<"], "cells"),
    (("stability", "devices"), STABILITY, [], ["rate 1000 Hz"], "devices"),
]


class Report(unittest.TestCase):
    def good(self, words, data, more, parts):
        out = run([*words, *more], data)
        for part in parts:
            self.assertIn(part, out, words)
        return out

    def refused(self, words, data):
        with self.assertRaises(tool.BadInput, msg=words) as caught:
            run(words, data)
        return str(caught.exception)

    def test_pages(self):
        for words, data, more, parts, _ in PAGES:
            out = self.good(words, data, more, parts)
            for gap in ("  us", " at  ", "|NO", "nan", "None"):
                self.assertNotIn(gap, out, words)

    def test_rows_of_instruction_sets_that_a_machine_lacks_stay_with_their_origin(self):
        def measured(day, *sets, us=2):
            rows = [{**KERNEL, "isa": isa, "ns_p50": 1e3 * us} for isa in ("paper", *sets, "scalar")]
            layout = [{**rows[1], "name": "contact/ball16/128x128x80"}]
            queries = [{**row, "name": "contact/query"} for row in reversed(rows)]
            return {"provenance": f"{day}, a machine.", "rows": rows, "queries": queries, "layout": layout}

        def kernels(page):
            return [line.split(" | ")[2:4] for line in page.splitlines() if line.startswith("| contact")]

        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "performance.md")

            def regenerate(data):
                part = run(["kernels", "page", str(file)], data)
                file.write_text(f"<!-- begin kernels -->\n{part}<!-- end kernels -->\n\n| iso | 1 | 2 | 3 | 4 | 5 | 6 |\n", encoding="utf-8")
                return part

            whole = regenerate(measured("2026-01-01", "avx512", "avx2"))
            self.assertEqual(whole, run(["kernels", "page"], measured("2026-01-01", "avx512", "avx2")))
            for day in ("2026-02-02", "2026-03-03"):
                part = regenerate(measured(day, "avx2", us=3))
                self.assertIn(f"\n{day}, a machine.\n\nRows of `avx512` are of another machine: 2026-01-01, a machine.\n\n| tick", part)
                times = {"paper": "3.00", "avx512": "2.00", "avx2": "3.00", "scalar": "3.00"}
                order = [*times, *reversed(times)]
                self.assertEqual(kernels(part)[:8], [[name, times[name]] for name in order])
                self.assertEqual(sorted(kernels(part)[8:]), [["avx2", "3.00"], ["avx512", "2.00"]])
            self.assertIn("Rows of `avx2` are of another machine: 2026-03-03, a machine.\n\n| tick", regenerate(measured("2026-04-04", "avx512")))
            again = measured("2026-05-05", "avx512", "avx2", us=5)
            self.assertNotIn("another machine", regenerate(again))
            self.assertEqual([cells[1] for cells in kernels(file.read_text(encoding="utf-8"))], 9 * ["5.00"])
            # A tick that is no longer measured goes, whatever its set.
            self.assertNotIn("128x128x80", regenerate({**measured("2026-06-06", "avx2"), "layout": [{**KERNEL, "name": "copy"}]}))

    @unittest.skipUnless(CAN_PLOT, "no matplotlib")
    def test_a_plot_is_svg(self):
        for words, data, more, parts, _ in PLOTS:
            out = self.good(words, data, more, parts)
            self.assertEqual(xml.fromstring(out).tag, "{http://www.w3.org/2000/svg}svg")

    @unittest.skipUnless(CAN_PLOT, "no matplotlib")
    def test_a_plot_is_the_same_each_time_and_in_each_process(self):
        words, data, _, _, _ = PLOTS[0]
        self.assertEqual((0, run(words, data), ""), run_alone(words, data))
        words, data, _, _, _ = PLOTS[5]
        self.assertEqual((0, run(words, data), ""), run_alone(words, data))

    def test_bad_input_gives_one_line(self):
        for words, data, more, _, rows in PAGES + (PLOTS if CAN_PLOT else []):
            words = [*words, *more]
            self.assertIn("no JSON", self.refused(words, ""))
            self.assertIn("no JSON", self.refused(words, '{"rows": ['))
            self.refused(words, [])
            self.refused(words, {**data, rows: []})
            less = {key: value for key, value in data.items() if key != rows}
            self.assertIn(f"no '{rows}'", self.refused(words, less))
        self.assertIn("did you mean stability_map map?", self.refused(["stabilty", "map"], {}))
        code, out, complaint = run_alone(["kernels", "page"], {})
        self.assertEqual((code, out, complaint.count("\n")), (2, "", 1))
        self.assertTrue(complaint.startswith("lab/report: kernels page: no 'provenance' in the JSON"), complaint)

    def test_a_page_needs_no_matplotlib_and_a_plot_says_what_it_needs(self):
        bare = load_tool()
        bare.DEBIAN = "/nonexistent"
        with mock.patch.object(importlib.util, "find_spec", return_value=None):
            with mock.patch.object(sys, "stdin", io.StringIO(json.dumps(KERNELS))):
                self.assertTrue(bare.run(["kernels", "page"]).startswith("# Performance"))
            for words in (["check"], ["burs", "sheet"]):
                with self.assertRaisesRegex(Exception, "apt-get install python3-matplotlib"):
                    bare.run(words)

    def test_the_front_leaves_out_what_another_choice_beats_in_time_and_error(self):
        import accuracy
        rows = [{"knob": "kernel", "value": name, "standard": False, "plain": False, "shape": "all",
                 "metric": "loop_tool_rms", "figure": error, "us_p50": us, "us_p99": us}
                for name, us, error in (("slow", 20, 1e-5), ("fast", 1, 1e-3), ("beaten", 10, 2e-3),
                                        ("hardly better", 15, 0.995e-3))]
        marks = accuracy.marks_of(accuracy.entries_of({"rows": rows}), "loop_tool_rms", 1)
        self.assertEqual([mark[2] for mark in marks if mark[4]], ["fast", "slow"])
        self.assertEqual(len(marks), 4)

    def test_labels_cover_neither_each_other_nor_marks_and_stay_in_the_panel(self):
        import accuracy
        room = accuracy.Room(200, 60)
        room.taken.append((95, 25, 105, 35))
        self.assertEqual(room.place("first", 100, 30)[2], "left")
        self.assertEqual(room.place("second", 100, 30)[2], "right")
        self.assertGreater(room.place("third", 100, 30)[1], 30)
        self.assertIsNone(room.place("x" * 40, 100, 30))  # wider than the panel


if __name__ == "__main__":
    if not CAN_PLOT:
        print("skipped: no matplotlib; apt-get install python3-matplotlib")
    unittest.main(argv=sys.argv[:1])
