# SPDX-License-Identifier: Apache-2.0
"""What the reference pages read from the C++ source: constants, enumerators, structs, keys of JSON and of scripts."""
import re

TYPES = {"std::uint8_t": ("u8", 1), "char": ("char", 1), "std::uint16_t": ("u16", 2), "std::int16_t": ("i16", 2),
         "std::uint32_t": ("u32", 4), "std::int32_t": ("i32", 4), "float": ("f32", 4), "std::uint64_t": ("u64", 8),
         "std::int64_t": ("i64", 8), "double": ("f64", 8)}


class Lack(Exception):
    """A page and the source do not agree; one line."""


class Source:
    def __init__(self, root, path):
        self.path, self.text = path, (root / path).read_text(encoding="utf-8")

    def body(self, begin):
        """From the first line that has `begin` to the closing brace at a line's start."""
        at = self.text.find(begin)
        if at < 0:
            raise Lack(f"{self.path}: no '{begin}'; tests/docs/reference has to follow")
        return self.text[at:self.text.index("\n}", at)]

    def number(self, name):
        """A constant that is written as one number, as 1 shifted, or as a product of two."""
        found = re.search(rf"\b{name}(?: =|\{{)\s*([^;}}]+)", self.text)
        value = found and found[1].strip().replace("'", "")
        if shift := value and re.fullmatch(r"(?:std::uint\d+_t\{1\}|1U?) << (\d+)", value):
            return 1 << int(shift[1])
        if factors := value and re.fullmatch(r"(\d+) \* (\d+)", value):
            return int(factors[1]) * int(factors[2])
        try:
            return int(value, 0)
        except (TypeError, ValueError):
            pass
        try:
            return float(value)
        except (TypeError, ValueError):
            raise Lack(f"{self.path}: {name} is no plain number; tests/docs/reference has to follow") from None

    def numbers(self, name):
        """The numbers of an array, without the units behind them."""
        found = re.search(rf"\b{name}(?: =|\{{)\s*\{{?([^;}}]*)", self.text)
        if not found:
            raise Lack(f"{self.path}: no {name}; tests/docs/reference has to follow")
        return [float(one) for one in re.findall(r"-?\d+(?:\.\d+)?", re.sub("//.*", "", found[1]))]

    def words(self, name):
        """The texts of an array."""
        return re.findall(r'"([^"]+)"', re.search(rf"\b{name}(?: =)?\s*\{{(.*?)\}};", self.text, re.S)[1])

    def comment_above(self, begin):
        """The `///` lines right above the line that has `begin`, as text."""
        above = self.text[:self.text.index(begin)].rstrip("\n").split("\n")
        lines = []
        while above and above[-1].lstrip().startswith("///"):
            lines.insert(0, above.pop().lstrip()[3:].removeprefix(" "))
        return "\n".join(lines)

    def json_keys(self, begin):
        """Every key that a function gives to JSON, nested ones too."""
        body = self.body(begin)
        return set(re.findall(r'\{"([a-z_0-9]+)",', body)) | set(re.findall(r'\w\["([a-z_0-9]+)"\]', body)) | set(
            re.findall(r'\bvisit\("([a-z_0-9]+)",', body))

    def allowed(self, begin):
        """The keys that a function of a script lets pass."""
        return re.findall(r'"([a-z_]+)"', re.search(r"allow_only\(\{(.*?)\}\)", self.body(begin), re.S)[1])

    def defaults(self, begin, header):
        """{key: default} of what a function of a script reads; `script.NAME` is the initialiser in the header."""
        found = {}
        for key, value in re.findall(r'\.(?:number|whole|word)\((?:\w+ \? "\w+" : )?"(\w+)", ([^,]+),', self.body(begin)):
            if member := re.fullmatch(r"script\.(\w+)", value):
                value = re.search(rf"\b{member[1]} = ([^;]+);", header.text)[1]
            found[key] = value.strip('"')
        return found

    def enumerators(self, name):
        """(enumerator, comment) of an enum with a line each, or with its values on one line."""
        body = re.search(rf"enum class {name} [^{{]*\{{(.*?)\}};", self.text, re.S)[1]
        rows = re.findall(r"(\w+)(?: = (\w+))?,?\s*(?:///< (.*))?", body)
        return [(word, value, comment) for word, value, comment in rows]

    def struct(self, name):
        """(offset, field, type, count, comment) of a struct of plain numbers at natural alignment; its size."""
        rows, at, widest = [], 0, 1
        for line in self.body(f"struct {name} {{").splitlines()[1:]:
            found = re.match(r"  ([\w:]+) ([^;]+);\s*(?:///< (.*))?", line)
            if found and found[1] in TYPES:
                kind, size = TYPES[found[1]]
                for field in found[2].split(", "):
                    word, _, count = field.rstrip("]").partition("[")
                    at = -(-at // size) * size
                    rows.append((at, word, kind, int(count or 1), found[3] or ""))
                    at, widest = at + size * int(count or 1), max(widest, size)
            elif more := re.match(r"\s+///< (.*)", line):
                rows[-1] = (*rows[-1][:4], f"{rows[-1][4]} {more[1]}".strip())
        return rows, -(-at // widest) * widest


def same(place, documented, there):
    """The page's rows and the source's keys are the same."""
    documented, there = set(documented), set(there)
    if lacking := there - documented:
        raise Lack(f"{place}: has {', '.join(sorted(lacking))}, which tests/docs/reference does not describe")
    if surplus := documented - there:
        raise Lack(f"{place}: has no {', '.join(sorted(surplus))}, which tests/docs/reference describes")


def same_defaults(place, rows, there):
    """The page's defaults, in the third column, are the source's, where that names one of use."""
    for key, _, default, *_ in rows:
        value, told = there.get(key), default.split(":")[0].strip("`")
        if told in ("needed", "none", "not checked", "") or value is None:
            continue
        if told != value and not (re.fullmatch("[-0-9.]+", value) and re.fullmatch("[-0-9.]+", told) and float(told) == float(value)):
            raise Lack(f"{place}: {key} is {value} by default, and tests/docs/reference says {told}")


def table(heads, rows):
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return "\n".join(lines + ["| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in rows])


def plain(number):
    return f"{number:g}" if isinstance(number, float) else str(number)
