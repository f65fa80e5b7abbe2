# SPDX-License-Identifier: Apache-2.0
"""What a phase, a stop or a change of mode must reset, left out at one point at a time: `.ci/mutate.py resets [PATTERN]`.

.ci/resets.txt names structs that last from tick to tick, one a line: `STRUCT [MEMBER...] @ HEADER @ SOURCES @ OBJECTS @ CATCHER`. Of each field
every statement of the sources that gives it a constant or another value as it is is a reset, and so is each call of `begin_anew` and its like, the 0 of a
`? : 0`, and the field's part if a MEMBER that is such a struct is reset by `= {}`, or a law begins anew. All resets of a program are compiled once, each behind a switch;
then the catcher (test cases of a program) runs once for each. Nothing in the tree is touched."""
import dataclasses
import re

TABLE = ".ci/resets.txt"
CONSTANT = (r"(?:\{[^{};]*\}|-?\d+U?|false|true|nullptr|[A-Z][\w:]*::\w+|k[A-Z]\w*|[\w.]+|(?:typename N::)?(?:Real|Energy|N)\([\w.]+\))")
CALLS = r"(?:begin_anew|reset|clear|fill|ramp|search_again|change_tool|send)"
OWNER = r"(?:[\w\[\]()]+(?:\.|->))*"
START = r"(?<=[;{})])(\s*(?://[^\n]*\n\s*)*(?:else )?)"
SWITCH = """#ifndef KERF_LEFT_OUT
#define KERF_LEFT_OUT
#include <cstdlib>
inline bool kerf_left_out(int which) {
  static const int chosen = [] {
    const char* const text = std::getenv("KERF_LEFT_OUT");
    return text == nullptr ? -1 : std::atoi(text);
  }();
  return chosen == which;
}
template <class T>
T& kerf_put(bool left_out, T& to) noexcept {
  static T bin{};
  return left_out ? bin : to;
}
#endif
"""


@dataclasses.dataclass
class State:
    """A line of the table."""
    struct: str
    header: str
    sources: list
    objects: list  # regular expressions: objects of the release build that hold the sources
    program: str  # that catches it, by test cases
    cases: str
    members: list  # names under which other structs hold it whole
    is_law: bool  # begun anew in the memory of a law
    fields: list = dataclasses.field(default_factory=list)
    untried: set = dataclasses.field(default_factory=set)  # resets that change nothing: name, file and text of the line


@dataclasses.dataclass
class Reset:
    """A statement that is left out if its number is chosen."""
    name: str
    file: str
    line: int
    text: str  # of the line
    state: State

    def untried(self):
        """The line of the table that says why it is not left out, or None."""
        return next((no for no in self.state.untried if no[:2] == (self.name, self.file) and no[2] in self.text), None)


def fields_of(text, struct):
    """The names of a struct's or class's data members."""
    at = 0
    for part in struct.split("::"):
        begin = re.compile(rf"(?:struct|class) {part}\b[^;{{]*{{").search(text, at)
        if not begin:
            return []
        at = begin.end()
    depth = 1
    flat = ""
    while depth:
        char = text[at]
        depth += {"{": 1, "}": -1}.get(char, 0)
        if depth == 1:
            flat += ";" if char == "}" else char
        at += 1
    flat = re.sub(r"//.*", "", flat)
    names = []
    for statement in flat.split(";"):
        statement = " ".join(statement.split())
        if "(" in statement.split("=")[0] or re.match(r"(operator|static|using|friend|enum|struct|class|template)\b", statement):
            continue
        declared = re.sub(r"^(?:(?:public|private|protected): )*", "", statement)
        typed = re.match(r"(?:[\w:<>,\s*&]+?)[\s>*&]([a-z]\w*(?:\s*(?:=[^,]*)?,\s*[a-z]\w*)*)\s*(?:=.*)?$", declared)
        if typed:
            names += re.findall(r"(?:^|,)\s*([a-z]\w*)", typed[1])
    return names


def read_table(root):
    states = []
    for line in (root / TABLE).read_text().splitlines():
        if not line or line.startswith("#"):
            continue
        if line.startswith("no "):
            name, file, text, _ = line.removeprefix("no ").split(" @ ")
            for state in states:
                state.untried |= {(name, file, text)} if name.startswith(f"{state.struct}.") else set()
            continue
        struct, header, sources, objects, catcher = line.split(" @ ")
        program, _, cases = catcher.partition(" ")
        struct, _, members = struct.partition(" ")
        state = State(struct, header, sources.split(), objects.split(), program, cases, members.split(), "::State" in struct)
        state.fields = fields_of((root / header).read_text(), struct)
        if not state.fields:
            raise ValueError(f"{struct}: no fields of it in {header}; correct {TABLE}")
        states.append(state)
    return states


def read_programs(root):
    """By program: its lines of the table, and their sources with switches."""
    states = read_table(root)
    programs = sorted({state.program for state in states})
    return {program: Sources(root, [state for state in states if state.program == program]) for program in programs}


class Sources:
    """Files with a switch before each reset."""

    def __init__(self, root, states):
        self.root, self.states, self.resets = root, states, []
        self.changed = {}
        for file in sorted({source for state in states for source in state.sources}):
            self.changed[file] = self.switched(file)
        used = {reset.untried() for reset in self.resets}
        for no in sorted({no for state in states for no in state.untried} - used):
            raise ValueError(f"no {' @ '.join(no)}: there is no such reset; correct {TABLE}")

    def switched(self, file):
        text = (self.root / file).read_text()
        edits = {}  # by where they begin: end, text with numbers to fill in, fields, and the struct of each
        for state in self.states:
            if file in state.sources:
                for begin, end, new, fields in self.of_struct(text, state):
                    edits.setdefault(begin, (end, new, fields, [state] * len(fields)))
        edits |= self.of_laws(text, [state for state in self.states if state.is_law and file in state.sources])
        whole = text
        for begin, (end, new, fields, states) in sorted(edits.items(), reverse=True):
            line = text.count("\n", 0, begin) + 1
            for state, field in zip(states, fields):
                new = new.replace("@", f"kerf_left_out({len(self.resets)})", 1)
                self.resets.append(Reset(f"{state.struct}.{field}", file, line, text.splitlines()[line - 1], state))
            whole = whole[:begin] + new + whole[end:]
        return SWITCH + self.without_constants(whole)

    @staticmethod
    def without_constants(text):
        """What has a switch in it cannot be a constant."""
        for found in reversed(list(re.finditer(r"(?m)^( *)(?:\[\[nodiscard\]\] )?(?:static )?(constexpr )(?=[^=;]*\()(?![^(=;]*\bk[A-Z]\w*\()", text))):
            ends = [text.find("}\n", found.end()), text.find(f"\n{found[1]}}}", found.end())]
            one_line = "\n" not in text[found.end():ends[0]]
            if "kerf_left_out" in text[found.end():ends[0] if one_line else ends[1]]:
                text = text[:found.start(2)] + "inline " + text[found.end(2):]
        return text

    @staticmethod
    def of_laws(text, laws):
        """The fresh state of a law that begins anew, but for one field; which struct has it the compiler finds out."""
        found = re.search(r"::new \(static_cast<void\*>\(memory\.bytes\.data\(\)\)\) State\{\};", text)
        if not laws or not found:
            return {}
        all_fields = [(law, field) for law in laws for field in law.fields]
        parts = "".join(f" if constexpr (requires {{ Law::kName; }}) if constexpr (std::string_view(Law::kName) == \"{law.members[0]}\") {{"
                        f" if constexpr (requires {{ kerf_new.{field}; }}) {{ if (@) kerf_new.{field} = kerf_kept.{field}; }} }}"
                        for law, field in all_fields)
        new = ("State kerf_new{}; const State kerf_kept = *reinterpret_cast<const State*>(memory.bytes.data());"
               f"{parts} ::new (static_cast<void*>(memory.bytes.data())) State(kerf_new);")
        return {found.start(): (found.end(), new, [field for _, field in all_fields], [law for law, _ in all_fields])}

    def of_struct(self, text, state):
        for member in [] if state.is_law else state.members:
            for found in re.finditer(rf"{START}({OWNER}{member}(?:\[[^\]]*\])*) = \{{\}};", text):
                to = found[2]
                parts = "".join(f" if (@) {to}.{field} = kerf_kept.{field};" for field in state.fields)
                yield (found.start(2), found.end(), f"{{ const auto kerf_kept = {to}; if (!@) {to} = {{}};{parts} }}",
                       ["all", *state.fields])
        for field in state.fields:
            for begin, end, new in self.of_field(text, field):
                if not re.match(r"(?:out|sensed|contact)\.", text[begin:end]):
                    yield begin, end, new, [field]

    @staticmethod
    def of_field(text, field):
        name = rf"{OWNER}{field}(?:\[[^\]]*\])*"
        for found in re.finditer(rf"(?:{START}|= )({name})(?= = (?:[\w.\->\[\]]+ = )*{CONSTANT};)", text):
            yield found.start(2), found.end(2), f"kerf_put(@, {found[2]})"
        for found in re.finditer(rf"{START}({name}\.{CALLS}\([^;]*\);)", text):
            yield found.start(2), found.end(2), f"{{ if (!@) {found[2]} }}"
        for found in re.finditer(rf"({name}) = ([^;=?]* \? [^;]*: )0;", text):
            yield found.start(), found.end(), f"{found[1]} = {found[2]}@ ? {found[1]} : 0;"
        for found in re.finditer(rf"({name}) = ([^;=?]* \? )0 : ([^;]*);", text):
            yield found.start(), found.end(), f"{found[1]} = {found[2]}(@ ? {found[1]} : 0) : {found[3]};"
