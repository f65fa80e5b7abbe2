# SPDX-License-Identifier: Apache-2.0
"""Formulas of the pages, which are written as plain text, for the site: an indented block becomes MathML, which browsers draw
without a script; within a text, subscripts and exponents become HTML.

A formula is read token by token: words stay words, letters become variables, `x_i`, `x_{i+1}` and `x1` have a subscript, `x^2`
and `x^(a + b)` an exponent. Nothing is rearranged, so a formula reads as it was written."""
import html
import re

GREEK = dict(alpha="α", delta="δ", lambda_="λ", mu="μ", omega="ω", phi="φ", PHI="Φ", pi="π", rho="ρ", sigma="σ", tau="τ", theta="θ")
FUNCTIONS = {"atan2", "beta", "cos", "exp", "max", "min", "Re", "sin", "median"}
SIGNS = {"<=": "≤", ">=": "≥", "!=": "≠", "->": "→", "<-": "←", "+-": "±", "*": "·", ".": "·", "-": "−", "~": "∼"}
TOKEN = re.compile(r"\s*(?:(?P<number>\d+(?:\.\d+)?)|(?P<word>[A-Za-z](?:[A-Za-z']*[A-Za-z])?)(?P<digits>\d*)"
                   r"(?:_(?P<sub>\{[^}]*\}|[A-Za-z0-9]+))?|(?P<sign><=|>=|!=|->|<-|\+-|[-+*/=<>~.,:;|()\[\]^]))")


def element(name, *children):
    return f"<{name}>{''.join(children)}</{name}>"


def bracket(sign):
    return f'<mo stretchy="false">{sign}</mo>'


def is_text(word):
    """Whether a word of a formula stays one."""
    return word and len(word) > 1 and word not in GREEK and word not in FUNCTIONS and word not in ("SUM", "grad", "sqrt")


class Formula:
    """One formula as MathML; raises ValueError for a text that is none."""

    def __init__(self, text):
        self.tokens, self.before, at = [], None, 0
        while at < len(text.rstrip()):
            token = TOKEN.match(text, at)
            if not token:
                raise ValueError(text)
            self.tokens.append(token)
            at = token.end()

    def mathml(self):
        return element("math", element("mrow", *self.row()))

    def next_sign(self):
        return self.tokens[0]["sign"] if self.tokens else None

    def row(self, end=None):
        """Up to the closing bracket, which is taken."""
        found = []
        while self.tokens:
            if end and self.next_sign() == end:
                self.tokens.pop(0)
                return found
            part = self.part()
            if self.next_sign() == "^":
                self.tokens.pop(0)
                part = element("msup", part, self.exponent())
            found.append(part)
        if end:
            raise ValueError(end)
        return found

    def exponent(self):
        if self.next_sign() == "(":
            self.tokens.pop(0)
            return element("mrow", *self.row(")"))
        if self.next_sign() == "-":
            return element("mrow", self.part(), self.part())
        return self.part()

    def part(self):
        if not self.tokens:
            raise ValueError("ends early")
        token, before = self.tokens.pop(0), self.before
        self.before = token
        if token["number"]:
            return element("mn", token["number"])
        if token["word"]:
            return self.word(token, before)
        sign = token["sign"]
        if sign in "([":
            close = {"(": ")", "[": "]"}[sign]
            return element("mrow", bracket(sign), *self.row(close), bracket(close))
        if sign in ")]^":
            raise ValueError(sign)
        return element("mo", html.escape(SIGNS.get(sign, sign)))

    def word(self, token, before):
        """`before`: the token in front of it, which decides about blanks, as the next one does."""
        word, sub = token["word"], token["sub"] or token["digits"]
        blank = "\u00a0" if before and before["sign"] not in ("(", "[") else ""
        if word == "sqrt":
            return element("msqrt", *(self.row(")") if self.next_sign() == "(" and self.tokens.pop(0) else [self.part()]))
        if re.fullmatch("[A-Z][xyz]", word):
            word, sub = word[0], word[1]
        if word == "mm" and sub in ("2", "3"):
            return element("msup", f"<mtext>{blank}mm</mtext>", element("mn", sub))
        if word in GREEK or len(word) == 1:
            base = element("mi", GREEK.get(word, word))
        elif word in ("SUM", "grad"):
            base = element("mo", {"SUM": "∑", "grad": "∇"}[word])
        elif word in FUNCTIONS:
            space = "<mspace width='0.2em'/>"
            base = (space if blank else "") + element("mi", "B" if word == "beta" else word) + ("" if self.next_sign() == "(" else space)
        elif len(word) == 2 and word[0] == "d":
            base = element("mrow", "<mspace width='0.15em'/><mi mathvariant='normal'>d</mi>", element("mi", word[1]))
        else:
            follows = self.tokens and not sub and not is_text(self.tokens[0]["word"]) and self.next_sign() not in tuple(")],;:")
            base = element("mtext", blank + html.escape(word) + ("\u00a0" if follows else ""))
        if not sub:
            return base
        # A font without figures for formulas would leave it on the line.
        below = element("mpadded", Formula(sub.strip("{}")).mathml()[6:-7]).replace(">", ' voffset="-0.2em" depth="+0.2em">', 1)
        return element("msub", element("mrow", base), below)


def block(lines):
    """HTML of a block's lines, or nothing if it is no formula. Two blanks part a line."""
    try:
        rows = [[Formula(part).mathml() for part in re.split(r"\s{2,}", re.sub(r"\s+([=~])\s+", r" \1 ", line.strip()))] for line in lines]
    except ValueError:
        return None
    if not all(re.search(r"[=~<-]", line) for line in lines):
        return None
    return element("div", *(element("div", " ".join(row)) for row in rows)).replace("<div>", '<div class="formula">', 1)


def in_text(text):
    """HTML of the subscripts, exponents and signs within a text that has no code and no links."""
    def base(word):
        return f"<i>{GREEK.get(word, word)}</i>"
    text = re.sub(r"\bSUM(?:_(\w+))?", lambda m: "∑" + (f"<sub>{m[1]}</sub>" if m[1] else ""), text)
    text = re.sub(r"\b([A-Za-z]+)_(\{[^}]*\}|\w+)", lambda m: f"{base(m[1])}<sub>{m[2].strip('{}')}</sub>", text)
    text = re.sub(r"\b([mp])(\d)\b", r"<i>\1</i><sub>\2</sub>", text)
    text = re.sub(r"\bmm([23])\b", r"mm<sup>\1</sup>", text)
    text = re.sub(r"\b(%s)\b" % "|".join(GREEK), lambda m: base(m[1]), text)
    text = re.sub(r"\^(?:\(([^()]*)\)|(-?\w+))", lambda m: f"<sup>{m[1] or m[2]}</sup>", text)
    text = re.sub(r"\bsqrt(?= ?[(\d\w])", "√", text)
    text = re.sub(r"\bgrad (?=\w)", "∇", text)
    return re.sub(r"(?<=[\w)>]) \* (?=[\w(<])", " · ", text).replace("<=", "≤").replace(">=", "≥").replace("+-", "±")
