# SPDX-License-Identifier: Apache-2.0
"""A CSV table of `./kerf lab zwidth` or `./kerf sweep`."""
import csv


def columns_of(path, only=()):
    """{name: values} of the rows that have these (name, text). Values are numbers where all of them are; an empty one
    is NaN then, as in a run that failed."""
    with open(path, encoding="utf-8", newline="") as file:
        head, *rows = [*csv.reader(file)] or [[]]
    for name, _ in only:
        if name not in head:
            raise ValueError(f"{path}: {name}: no column; it has {', '.join(head) or 'none'}")
    rows = [row for row in rows if all(row[head.index(name)] == text for name, text in only)]
    columns = {}
    for name, texts in zip(head, zip(*rows) if rows else [()] * len(head)):
        try:
            columns[name] = [float(text or "nan") for text in texts]
        except ValueError:
            columns[name] = list(texts)
    return columns


def way(columns, *cell):
    """What to keep if several rows have one cell: a value of the column with the fewest of those that tell them apart."""
    apart = [name for name, values in columns.items() if len({*zip(*cell, values)}) == len(values)]
    name = min(apart, key=lambda name: len({*columns[name]}), default="COLUMN")
    value = columns[name][0] if apart else "VALUE"
    return f"keep those of one {name}, such as {name}={value if isinstance(value, str) else f'{value:g}'}"
