# SPDX-License-Identifier: Apache-2.0
"""Figures and tables of pages, in Markdown."""


class BadInput(Exception):
    """Input or set-up that makes no page and no plot; one line."""


def figure(value):
    """Three digits, or all before the point."""
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def table(columns, rows):
    """`columns`: titles; one that begins with > has its figures at the right."""
    lines = [[column.lstrip(">") for column in columns], None, *rows]
    marks = "|".join("---:" if column.startswith(">") else "---" for column in columns)
    return "".join(f"|{marks}|\n" if line is None else "| " + " | ".join(line) + " |\n" for line in lines)


def rows_of(data, key="rows"):
    """A list of at least one value."""
    if not data[key]:
        raise BadInput(f"lab/report: the list '{key}' of the JSON is empty; measure at least one row")
    return data[key]
