# SPDX-License-Identifier: Apache-2.0
"""docs/api.md: what include/kerf declares, and what `import kerf` has, from the comments and docstrings."""
import ast
import re

from source import Lack

HEADERS = ("scene.hpp", "servo.hpp", "tick.hpp", "hand.hpp", "law.hpp", "stability.hpp", "log.hpp", "segment.hpp", "device.hpp", "external.h")
MODULE = ("scene", "loop", "log", "law", "stability", "device")
TEXT = r'((?:\s*"(?:\\.|[^"\\])*")+|\s*R"\(.*?\)")'


def declarations(root, name):
    """A header for its reader: its comment, then the code without preprocessor lines and private parts."""
    text = (root / "include" / "kerf" / name).read_text(encoding="utf-8")
    text = re.sub(r"\A(// SPDX.*|/\* SPDX[^\n]*\n \*\n)", lambda found: "/*\n" if found[0].startswith("/*") else "", text)
    text = re.sub(r"^ *#(?:.*\\\n)*.*\n", "", text, flags=re.M)  # a macro of several lines, too
    text = re.sub(r"^ private:\n.*?(?=^\};)", "", text, flags=re.M | re.S)
    text = re.sub(r"^(?:extern \"C\" )?(?:namespace [\w:]+ )?\{\n|^\}  // namespace.*\n", "", text, flags=re.M)
    return re.sub(r"\n{3,}", "\n\n", text).strip()


def words_of(literals):
    """The text of C++ string literals that follow one another."""
    if literals.startswith("R"):
        return literals[3:-2]
    return "".join(ast.literal_eval(one) for one in re.findall(r'"(?:\\.|[^"\\])*"', literals))


def signature(function):
    """NAME(ARGUMENTS) of a Python function, without self and notes of types."""
    arguments = function.args
    for one in [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]:
        one.annotation = None
    shown = re.sub(r"^(self|cls)(, |$)", "", ast.unparse(arguments))
    return f"{function.name}({shown})"


def item(head, doc):
    """A point of a list; its text keeps its blocks of code."""
    lines = (doc or "").strip().splitlines()
    return "\n".join([f"* `{head}`" + (f": {lines[0]}" if lines else ""), *(f"  {line}".rstrip() for line in lines[1:])])


def of_python(root, names):
    """{name: Markdown} of what python/kerf defines."""
    found = {}
    for file in sorted((root / "python" / "kerf").glob("*.py")):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            name = getattr(node, "name", "")
            if name not in names:
                continue
            doc = ast.get_docstring(node)
            if isinstance(node, ast.FunctionDef):
                found[name] = f"### {name}\n\n`{signature(node)}`\n\n{doc or ''}\n"
                continue
            methods = [one for one in node.body if isinstance(one, ast.FunctionDef) and (one.name == "__init__" or one.name[0] != "_")]
            marks = {one: [ast.unparse(mark) for mark in one.decorator_list] for one in methods}
            lines = [item(one.name if "property" in marks[one] else signature(one).replace("__init__", name), ast.get_docstring(one))
                     for one in methods if not any(mark.endswith(".setter") for mark in marks[one])]
            found[name] = f"### {name}\n\n{doc or ''}\n\n" + "\n".join(lines) + "\n"
    return found


def of_module(root, names):
    """{name: Markdown} of what python/module defines in C++."""
    found = {}
    for part in MODULE:
        source = (root / "python" / "module" / f"{part}.cpp").read_text(encoding="utf-8")
        for match in re.finditer(rf'(?:class_|enum_)<[^(]*>\(\s*module, "(\w+)"(?:,{TEXT})?\)(.*?);\n', source, re.S):
            if match[1] in names:
                members = re.findall(rf'\.(?:def\w*|value)\(\s*"(\w+)"((?:(?!\n      \.).)*)', match[3], re.S)
                lines = []
                for name, rest in members:
                    if name.startswith("_"):
                        continue
                    doc = re.search(rf"{TEXT}\s*\)\s*\Z", rest, re.S)
                    lines.append(item(name, words_of(doc[1].strip()) if doc else ""))
                found[match[1]] = f"### {match[1]}\n\n{words_of(match[2].strip()) if match[2] else ''}\n\n" + "\n".join(lines) + "\n"
        for match in re.finditer(rf'(?:module\.def|limit|limit_at)\(\s*"(\w+)",((?:(?!module\.def|limit).|highest_|\blimits?\b)*?){TEXT}\s*\);\n',
                                 source, re.S):
            if match[1] in names:
                arguments = re.findall(r'py::arg\("(\w+)"\)(?: = ([^,)]+))?', match[2])
                if not arguments:  # by the helpers of the file
                    arguments = [("loop", "")] + ([("damping_ns_per_mm", "")] if match[0].startswith("limit_at") else [])
                shown = ", ".join(name + (f"={value}" if value else "") for name, value in arguments)
                found[match[1]] = f"### {match[1]}\n\n`{match[1]}({shown})`\n\n{words_of(match[3].strip())}\n"
    return found


def page(root, _programs):
    listed = re.search(r"__all__ = \[(.*?)\]", (root / "python/kerf/__init__.py").read_text(encoding="utf-8"), re.S)[1]
    names = [name for name in re.findall(r'"(\w+)"', listed) if name not in ("TICK", "Segment", "SegmentError", "__version__")]
    known = {**of_module(root, names), **of_python(root, names)}
    if missing := [name for name in names if name not in known and name not in ("Error",)]:
        raise Lack(f"tests/docs/reference/api.py: does not find {', '.join(missing)} in python/kerf and python/module")
    python = re.sub(r"\n{3,}", "\n\n", "\n".join(known[name] for name in names if name in known))
    headers = "\n".join(f"### kerf/{name}\n\n`#include \"kerf/{name}\"`\n\n```cpp\n{declarations(root, name)}\n```\n" for name in HEADERS)
    return f"""# Interfaces for C++, C and Python

[Packages](compatibility.md#below-a-prefix-for-your-own-programs) describes how to build a program that uses the headers.
[Python](python.md) has examples. Only what this page lists is promised to stay within a version.

## C++ and C

{headers}
## Python: import kerf

`TICK` is the dtype of a row, with the columns of [the log](log.md). `Segment` is the class of [kerf_reader](compatibility.md#python).
`Error` is a `ValueError` with one line: location, value, remedy.

{python}"""
