#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether every relative link of README.md and docs/ leads to a file, and its anchor to a heading:  links.py ROOT

An anchor must be what both GitHub and mkdocs make of the heading, so that it works on either."""
import pathlib
import re
import sys
import unicodedata
import urllib.parse

import pages


def prose(page):
    """(line number, text) of what is not in a fence or an indented block; code within a line is blanked."""
    fenced = False
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        fenced ^= line.startswith("```")
        if not fenced and not line.startswith(("```", "    ")):
            yield number, re.sub(r"`[^`]*`", lambda code: " " * len(code[0]), line)


def headings(page):
    for line in page.read_text(encoding="utf-8").splitlines():
        if match := re.match(r"#+ (.*)", line):
            yield re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", match[1]).replace("`", "").strip()


def on_github(heading):
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def in_mkdocs(heading):
    plain = unicodedata.normalize("NFKD", heading).encode("ascii", "ignore").decode()
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", plain).strip().lower())


def faults_of(link, page):
    """What is wrong with a relative link of a page, or nothing."""
    path, _, anchor = urllib.parse.unquote(link).partition("#")
    target = (page.parent / path).resolve() if path else page
    if not target.exists():
        return f"{path}: no such file"
    if anchor and not any(on_github(h) == in_mkdocs(h) == anchor for h in headings(target)):
        return f"#{anchor}: no heading of {target.name} has this anchor on GitHub and in mkdocs"
    return None


def main(root):
    checked, wrong = 0, []
    for page in pages.all_pages(root):
        for number, line in prose(page):
            for link in re.findall(r"\]\(([^)\s]+)[^)]*\)", line):
                if re.match(r"[a-z]+:", link):  # elsewhere: a test asks no network
                    continue
                checked += 1
                if fault := faults_of(link, page):
                    wrong.append(f"{page.name}:{number}: {fault}")
    print(*wrong, sep="\n")
    print(f"{checked} links checked, {len(wrong)} wrong")
    return checked > 0 and not wrong


sys.exit(0 if main(pathlib.Path(sys.argv[1])) else 1)
