#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The site of `./kerf docs` as its reader has it, from a folder:  site_test.py ROOT

It is small, loads nothing from elsewhere, leaves no Markdown as text, has every page in its list, and its search finds. Its formulas
and drawings can be read, it fits on a phone, and it can be read in the dark. Exit code 77: skipped, for
want of mkdocs, or of chromium once all else is fine."""
import html.parser
import itertools
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

root = pathlib.Path(sys.argv[1]).resolve()
sys.path.insert(0, str(root / "tests" / "web"))
import browser
import pages

MOST_BYTES, MOST_INDEX_BYTES = 5_000_000, 1_000_000
MOST_ROWS = 20  # of README's table of pages; the site has the rest
NAMES = {"README": "start", "overview": "index"}  # pages of another name on the site
# What a reader types, and the section that must come among the first three.
NARROW = 390  # pixels of a phone
SEARCHES = [("zigzag_mm", "scene-keys.html#hands"), ("exit codes", "reports.html#exit-codes"),
            ("mouse pointer wheel", "window.html#a-hand-without-a-device-pointer-keys-gamepad-spacemouse"),
            ("threshold tissue HU", "own-volume.html#your-own-volume"),
            ("omni encoder wire", "wire.html#omni"), ("state_head", "api.html#segmentheader")]


class Loads(html.parser.HTMLParser):
    """What a page loads by itself: not where its links lead."""

    def __init__(self, text):
        super().__init__()
        self.addresses, self.anchors = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.anchors.add(values.get("id"))
        if tag != "a":
            self.addresses += [values[name] for name in ("src", "href", "data", "poster") if values.get(name)]


class Prose(html.parser.HTMLParser):
    """The text of a page's article outside of code, piece by piece, and its headings."""

    def __init__(self, text):
        super().__init__()
        self.within, self.pieces, self.headings = [], [], []
        self.feed(text.partition('role="main">')[2].partition("<footer")[0])

    def handle_starttag(self, tag, _):
        if tag not in ("br", "hr", "img", "input"):
            self.within.append(tag)
        self.headings += [""] if re.fullmatch("h[1-6]", tag) else []

    def handle_endtag(self, tag):
        while self.within and self.within.pop() != tag:
            pass

    def handle_data(self, text):
        if {"h1", "h2", "h3", "h4", "h5", "h6"} & set(self.within):
            self.headings[-1] += text
        elif not {"code", "pre", "script"} & set(self.within):
            self.pieces.append("\0" + text if self.within[-1:] == ["p"] else text)


# What is left of Markdown that was not understood: a fence, a heading, a row of a table, an item of a list right below a
# line of text, a link, a mark of emphasis, a line of C++.
LITERAL = re.compile(r"```|~~~|(?:^|[\0\n])(?:#{1,6} |\|[^\n]*\|$|[*+-] |\d+\. )|\]\(|\*\*|__\w|^#include", re.M)


def headings_of(markdown):
    """Those outside of fences."""
    fence = None
    for line in markdown.splitlines():
        if mark := re.match("```|~~~", line):
            fence = None if fence == mark[0] else fence or mark[0]
        elif fence is None and (heading := re.match(r"#+ (.*)", line)):
            yield re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading[1]).replace("`", "").replace("\\", "").strip()


def faults_of_prose(site):
    for page in pages.all_pages(root):
        file = site / f"{NAMES.get(page.stem, page.stem)}.html"
        shown, told = Prose(file.read_text(encoding="utf-8")), list(headings_of(page.read_text(encoding="utf-8")))
        for there, said in itertools.zip_longest(shown.headings, told):
            if there != said:
                yield f"{file.name}: the heading {there!r} is shown, and {said!r} was written"
                break
        for found in LITERAL.finditer("".join(shown.pieces)):
            yield f"{file.name}: Markdown as text: {found.string[max(0, found.start() - 20):found.end() + 40]!r}"


def faults_of_files(site):
    size = sum(file.stat().st_size for file in site.rglob("*") if file.is_file())
    print(f"{size} bytes")
    if size >= MOST_BYTES:
        yield f"{size} bytes, and {MOST_BYTES} are too many"
    for file in site.rglob("*.html"):
        page = Loads(file.read_text(encoding="utf-8"))
        for address in page.addresses:
            path = re.split("[?#]", address)[0]
            if re.match(r"([a-z]+:)?//", address):
                yield f"{file.name}: loads {address} from elsewhere"
            elif path and file.name != "404.html" and not (file.parent / path).exists():
                yield f"{file.name}: loads {address}, which is not there"
    for file in site.rglob("*.css"):
        for address in re.findall(r"""url\(['"]?([^'")]+)""", file.read_text(encoding="utf-8")):
            if not address.startswith("data:") and not (file.parent / re.split("[?#]", address)[0]).exists():
                yield f"{file.name}: loads {address}, which is not there"
    listed = (root / "mkdocs.yml").read_text(encoding="utf-8")
    for file in (root / "docs").glob("*.md"):
        if f": {NAMES.get(file.stem, file.stem)}.md\n" not in listed:
            yield f"mkdocs.yml: does not list {file.name}"
    rows = re.findall(r"^\| .*\]\(docs/.*\|$", (root / "README.md").read_text(encoding="utf-8"), re.M)
    if len(rows) > MOST_ROWS:
        yield f"README.md: its table of pages has {len(rows)} rows, and {MOST_ROWS} are the most"
    index = (site / "search/index.js").stat().st_size
    if index >= MOST_INDEX_BYTES:
        yield f"search/index.js: {index} bytes, and {MOST_INDEX_BYTES} are too many"


def faults_of_drawings():
    """A drawing has its text as text that can be read on a phone, a title for those who hear it, and colours for the dark."""
    margin, least = 30, 9.5  # pixels beside a picture, and of a letter's height
    for file in sorted((root / "docs/images").glob("*.svg")):
        text = file.read_text(encoding="utf-8")
        wide = float(re.search(r'viewBox="0 0 (\d+)', text)[1])
        smallest = min(float(size) for size in re.findall(r"font-size[:=]\W*(\d+)", text))
        for fault, found in (("no title", "<title" not in text), ("no text", "<text" not in text),
                             ("no colours for the dark", "prefers-color-scheme: dark" not in text),
                             (f"letters of {smallest * (NARROW - margin) / wide:.1f} pixels on a phone",
                              smallest * min(1, (NARROW - margin) / wide) < least)):
            if found:
                yield f"{file.name}: {fault}"


def faults_of_search(site, chromium):
    with tempfile.TemporaryDirectory() as profile:
        page = browser.Page(chromium, profile)
        try:
            for number, (words, place) in enumerate(SEARCHES):
                page.go((site / "index.html").as_uri() + f"?{number}")
                page.until(f"document.readyState === 'complete' && location.search === '?{number}'")
                page.evaluate("{const box = document.querySelector('#mkdocs-search-query'); "
                              f"box.value = {json.dumps(words)}; box.dispatchEvent(new Event('input'))}}")
                page.until("document.querySelectorAll('#mkdocs-search-results a').length > 0", 10)
                found = page.evaluate("[...document.querySelectorAll('#mkdocs-search-results a')].map((a) => a.href)")
                if (site / place.split("#")[0]).as_uri() + "#" + place.split("#")[1] not in found[:3]:
                    yield f"search: {words}: not {place} but {[one.rsplit('/', 1)[1] for one in found[:3]]}"
                for address in found:
                    file, _, anchor = address.rpartition("/")[2].partition("#")
                    if anchor not in Loads((site / file).read_text(encoding="utf-8")).anchors:
                        yield f"search: {words}: leads to {file}#{anchor}, which is not there"
            for words in ("stiffness", "token", "volume spacing"):
                page.go((site / "index.html").as_uri() + f"?q={words.replace(' ', '+')}")
                if not page.until("document.querySelectorAll('#mkdocs-search-results a').length > 3", 10):
                    yield f"search: {words}: finds too little"
            page.go((site / "log.html").as_uri() + "?q=qqqq+wwww")
            if not page.until("document.querySelector('#mkdocs-search-results')?.textContent === 'No results found'", 10):
                yield "search: does not say that it found nothing"
        finally:
            page.close()


def faults_of_looks(site, chromium):
    """Each page on a phone, and a page in the dark."""
    with tempfile.TemporaryDirectory() as profile:
        page = browser.Page(chromium, profile)
        try:
            page.size(NARROW, 844, touch=True)
            for file in sorted(site.glob("*.html")):
                page.go(file.as_uri())
                page.until(f"document.readyState === 'complete' && location.pathname.endsWith('/{file.name}')")
                if (width := page.evaluate("document.documentElement.scrollWidth")) > NARROW:
                    yield f"{file.name}: {width} pixels wide on a screen of {NARROW}"
            for scheme in ("light", "dark"):
                page.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
                page.go((site / "devices.html").as_uri() + f"?{scheme}")
                page.until(f"document.readyState === 'complete' && location.search === '?{scheme}'")
                for place in ("body", "h2", "p", "pre code", "td", "p code", "p a", ".bs-sidebar a"):
                    text, ground = page.evaluate(CONTRAST % json.dumps(place))
                    if (text > ground) != (scheme == "dark") or abs(text - ground) < 60:
                        yield f"devices.html: {scheme}: {place} has the brightness {text:.0f} on {ground:.0f}"
        finally:
            page.close()


# Brightness of an element's text, and of the nearest ground behind it that is not clear.
CONTRAST = """(() => {
  const brightness = (colour) => { const [r, g, b] = colour.match(/[\\d.]+/g).map(Number); return 0.3 * r + 0.6 * g + 0.1 * b; };
  const element = document.querySelector(%s);
  let behind = element;
  const clear = (one) => /rgba\\(.*, 0(\\.0.*)?\\)/.test(getComputedStyle(one).backgroundColor);
  while (behind.parentElement && clear(behind)) behind = behind.parentElement;
  return [brightness(getComputedStyle(element).color), clear(behind) ? 255 : brightness(getComputedStyle(behind).backgroundColor)];
})()"""


def faults_of_formulas(site):
    """Those of the pages of theory are MathML, and none is left as text; a page that is named is a link."""
    for page in ("theory.html", "forces.html"):
        text = (site / page).read_text(encoding="utf-8")
        formulas = re.findall(r"<math>(.*?)</math>", text)
        if len(formulas) < 15 or any(one.count("<m") != one.count("</m") + one.count("/>") for one in formulas):
            yield f"{page}: {len(formulas)} formulas, or one that does not close"
        bare = re.sub(r"<pre>.*?</pre>|<code>.*?</code>|<math>.*?</math>", "", text, flags=re.S)
        bare = bare.partition('role="main">')[2].partition("<footer")[0]
        yield from (f"{page}: a formula as text: {found}" for found in re.findall(r".{20}(?:\w\^|\w_[\w{]|<=|\bSUM\b).{10}", bare))
    for file in site.glob("*.html"):
        page = re.sub(r"<a [^>]*>.*?</a>|<pre>.*?</pre>", "", file.read_text(encoding="utf-8"), flags=re.S)
        yield from (f"{file.name}: {name}: is named and no link" for name in re.findall(r"<code>(docs/[\w-]+\.md)</code>", page))


def main():
    if not shutil.which("mkdocs"):
        print("skipped: no mkdocs; apt-get install mkdocs")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        site = pathlib.Path(folder) / "site"
        subprocess.run(["mkdocs", "build", "--quiet", "--strict", "--config-file", root / "mkdocs.yml", "--site-dir", site],
                       check=True)
        wrong = [*faults_of_files(site), *faults_of_prose(site), *faults_of_formulas(site), *faults_of_drawings()]
        chromium = browser.find_chromium()
        if chromium:
            wrong += [*faults_of_search(site, chromium), *faults_of_looks(site, chromium)]
    print(*wrong, sep="\n")
    print(f"{len(SEARCHES)} searches, {len(wrong)} wrong" if chromium else "skipped: no chromium to search in")
    return 1 if wrong else 0 if chromium else 77


sys.exit(main())
