#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether the site's search answers the questions of its readers, of questions.json:  questions_test.py ROOT

Each has its answer, a pattern, in one of the first three sections that are found; questions.mjs beside this file asks, without
a browser. Exit code 77: skipped, without mkdocs or node."""
import pathlib
import shutil
import subprocess
import sys
import tempfile

root, here = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(__file__).parent
for program in ("mkdocs", "node"):
    if not shutil.which(program):
        print(f"skipped: no {program}")
        sys.exit(77)
with tempfile.TemporaryDirectory() as folder:
    site = pathlib.Path(folder) / "site"
    subprocess.run(["mkdocs", "build", "--quiet", "--strict", "--config-file", root / "mkdocs.yml", "--site-dir", site], check=True)
    sys.exit(subprocess.run(["node", here / "questions.mjs", site / "search", here / "questions.json"]).returncode)
