#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether the pages name the keys of the window that kerf-visualizer --help lists, and no others:  keys.py ROOT BIN

docs/window.md has both, each in its table, as code: the keys of any window, then, below HAND, those of --hand mouse."""
import pathlib
import re
import subprocess
import sys

root, bin_folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
help_text = subprocess.run([bin_folder / "kerf-visualizer", "--help"], capture_output=True, text=True, check=True).stdout
window, _, hand = help_text.partition("In the window")[2].partition("With --hand-socket:")


def letters_of_help(text):
    return set(re.findall(r"^  ([a-z]|[a-z], [a-z])  ", text, re.M))


HAND = "\n## A hand without a device"
page, _, hand_page = (root / "docs" / "window.md").read_text().partition(HAND)


def letters_of_page(text):
    keys = [row.split("|")[1] for row in text.splitlines() if row.startswith("|")]
    return {letter.replace("`", "") for key in keys for letter in re.findall(r"`u`, `u`|`[a-z]`", key)}


told, told_hand = letters_of_help(window), letters_of_help(hand)
wrong = [f"window.md, {part}: {key}: {what}" for part, keys, what in (
    ("keys", told - letters_of_page(page), "is lacking"),
    ("keys", letters_of_page(page) - told, "is no key of the window"),
    ("hand", told_hand - letters_of_page(hand_page), "is lacking"),
    ("hand", letters_of_page(hand_page) - told_hand - told, "is no key of the window")) for key in sorted(keys)]
print(*wrong, sep="\n")
print(f"{len(told)} and {len(told_hand)} keys, {len(wrong)} wrong")
sys.exit(0 if len(told) > 15 and told_hand and not wrong else 1)
