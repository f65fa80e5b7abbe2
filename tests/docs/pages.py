#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""README.md and the pages of docs/ as tests read them: the commands that they print."""
import re

# What a command of the pages begins with. A block of indented lines in which a line begins so is a shell's.
HEADS = re.compile(r"\(?(\./kerf|\.ci/\S+|hil/\S+\.sh|build/\S+|cat|cd|cmake|cp|ctest|echo|export|grep|openssl|parallel|pip|podman|"
                   r"python3|scp|sudo|tests/\S+\.sh|venv/bin/\S+|wait|kerf-\S+ --socket)( |$)|([A-Z_]+=\S+ +)+build/")


def all_pages(root):
    return [root / "README.md", *sorted((root / "docs").glob("*.md"))]


def blocks(page):
    """Blocks of code, each a list of (line number, text): what is indented, and what a fence of sh encloses."""
    fence, block = None, []
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("```"):
            if fence is None and block:
                yield False, block
            elif fence == "sh":
                yield True, block
            fence, block = (line[3:].split(" ")[0], []) if fence is None else (None, [])
        elif fence is not None or line.startswith("    "):
            block.append((number, line.strip()))
        elif block:
            yield False, block
            block = []
    if block:
        yield False, block


def commands(page):
    """(line number, command, expected lines) of each command, without its comment. Lines that end in a backslash
    are one. In a block with a prompt `$ ` the other lines are what the command is expected to print."""
    for is_shell, block in blocks(page):
        prompts = any(text.startswith("$ ") for _, text in block)
        if not (is_shell or prompts or any(HEADS.match(text) for _, text in block)):
            continue
        joined, found = "", []
        for number, text in block:
            if prompts and not text.startswith("$ ") and not joined:
                found[-1][2].append(text)
                continue
            text = re.sub(r"(^|\s)#\s.*", "", joined + text.removeprefix("$ ")).strip()
            if text.endswith("\\"):
                joined = text[:-1]
            elif text:
                assert is_shell or HEADS.match(text), f"{page.name}:{number}: {text}: no command of HEADS"
                found.append((number, text, []))
                joined = ""
        yield from found


def inline(page):
    """(line number, command) of each `./kerf ...` in running text and tables, with one blank for each gap."""
    in_blocks = {number for _, block in blocks(page) for number, _ in block}
    starts, prose = [], ""
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        starts.append((len(prose), number))
        prose += ("" if number in in_blocks or line.startswith("```") else line) + "\n"
    for code in re.finditer(r"`([^`]+)`", prose):
        command = " ".join(code[1].replace("\\|", "|").split())
        if command.startswith("./kerf ") and "\n\n" not in code[1]:
            yield max(number for start, number in starts if start <= code.start()), command
