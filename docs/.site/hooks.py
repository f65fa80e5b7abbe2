# SPDX-License-Identifier: Apache-2.0
"""Hooks of mkdocs. The first page of the site is overview.md, and README is its page start.md, with its links seen from docs/.

The site works from a folder, without a server, and omits what no page uses. A browser loads no JSON from a folder, so the
search of mkdocs finds nothing there. The index becomes a script, in which find.js finds, by lunr, which comes with mkdocs (MIT)."""
import json
import pathlib
import re
import sys
import tempfile

from markdown.extensions.toc import slugify
from mkdocs.structure.files import File
from mkdocs.structure.nav import Link

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE))
import formulas
# Formats of the theme's fonts for browsers that are older than ten years.
OLD_FONTS = (".eot", ".svg", ".ttf", ".otf", ".woff")
FONTS = ("fonts", "webfonts")  # their folder in Debian 12, and since Debian 13


def on_files(files, config):
    docs = pathlib.Path(config["docs_dir"])
    page = re.sub(r"\]\(docs/", "](", (docs.parent / "README.md").read_text(encoding="utf-8"))
    page = re.sub(r"\[(`[^`\]]+`)\]\([A-Z]+\.md\)", r"\1", page)  # a file that is no page of the site
    files.remove(files.get_file_from_path("overview.md"))
    folder = tempfile.mkdtemp()  # mkdocs reads it when it builds
    for name, text in (("start.md", page), ("index.md", (docs / "overview.md").read_text(encoding="utf-8"))):
        pathlib.Path(folder, name).write_text(text, encoding="utf-8")
        files.append(File(name, folder, config["site_dir"], config["use_directory_urls"]))
    return files


def on_nav(nav, config, **_):
    """kerf itself, if ./kerf page has made it: `./kerf docs` copies it to try/."""
    root = pathlib.Path(config["docs_dir"]).parent
    if (root / "build/web/page/kerf.wasm").exists():
        nav.items.insert(1, Link("Try it", "try/index.html"))
    return nav


ITEM = re.compile(r" *([*+-]|\d+\.) +(?=\S)")


def as_python_markdown(markdown):
    """CommonMark, as GitHub shows it, for Python-Markdown: what belongs to an item of a list begins in its text's column
    there and behind four blanks here, an item behind a text needs a blank line, and a fence has a language alone: the file
    that it names too, ```cpp law.cpp, becomes its caption. Returns the lines, and of each its indentation as code, or nothing."""
    lines, codes, columns, fence = [], [], [], None  # columns: where the text of each open item begins
    for line in markdown.split("\n"):
        starts, item, open_items = not lines or not lines[-1], fence is None and ITEM.match(line), len(columns)
        indent = len(line) - len(line.lstrip())
        while columns and line and indent < columns[-1] and (starts or item) and fence is None:
            columns.pop()
        within = columns[-1] if columns else 0
        item = item if indent < within + 4 else None
        if item and not starts and len(columns) == open_items and item[1] not in "*+-1.":
            lines[-1] += " " + line.strip()  # a number that ended a sentence
            continue
        if item and not starts and not in_list:
            lines.append("")
            codes.append(0)
        if starts or item:
            in_list = bool(item)
        is_code = fence is None and line.strip() and not item and indent >= within + 4 and (starts or codes[-1])
        line = " " * 4 * len(columns) + line[min(indent, within):] if line.strip() else ""
        if mark := re.match(r" *```(\w*) *([\w./-]*)$", line):
            if fence is None and mark[2]:
                lines += [f'<p class="file"><code>{mark[2]}</code></p>', ""]
                codes += [0, 0]
                line = f"```{mark[1]}"
            fence = None if fence else mark[0]
            if columns:  # in an item Python-Markdown knows no fence, but a block
                line = ""
        elif fence and columns:
            line = "    " + line if line else ""
        elif item:
            columns.append(item.end())
        lines.append(line)
        codes.append(4 * len(columns) + 4 if is_code else 0)
    return lines, codes


FORMULAS = {"theory.md", "forces.md", "wire.md"}  # their indented blocks are formulas, where they can be read as such
IN_TEXT = {"theory.md", "forces.md"}  # formulas within its text, too
# Parts of a line that stay as they are, and a page that is named: in code, or plain, perhaps with its section behind it.
NAMED = re.compile(r"""(?P<link>!?\[[^]]*\]\([^)]*\)|<[^>]+>)|(?P<tick>`?)docs/(?P<page>[\w-]+\.md)(?P=tick)"""
                   r"""(?P<section>,? "[^"]+"| \d+(?:\.\d+)?(?![\w.]*\w))?|(?P<code>`[^`]*`)""")


def anchor_of(page, section):
    """'#' and the anchor of a section by its number or its title, or nothing."""
    if not section:
        return ""
    wanted = section.strip(', "')
    for heading in re.findall(r"^#+ (.*)", page.read_text(encoding="utf-8"), re.M):
        if re.match(re.escape(wanted) + r"(\.? |$)", heading):
            return "#" + slugify(heading.replace("`", ""), "-")
    return ""


def with_links(text, docs):
    """`docs/x.md` becomes a link to this page of the site, and to its section where one is named."""
    def link(found):
        page = found["page"] and docs / found["page"]
        if not page or not page.exists():
            return found[0]
        section = found["section"] or ""
        return f"[{found[0]}]({'index.md' if page.name == 'overview.md' else page.name}{anchor_of(page, section)})"
    return NAMED.sub(link, text)


def with_formulas(text):
    """Its parts outside of code, links and HTML."""
    return "".join(part if part[:1] in "`[<!" and len(part) > 1 else formulas.in_text(part)
                   for part in re.split(r"(`[^`]*`|!?\[[^]]*\]\([^)]*\)|<[^>]+>)", text))


def on_page_markdown(markdown, page, config, **_):
    docs, name = pathlib.Path(config["docs_dir"]), page.file.src_path
    lines, block, fenced = [], [], False
    markdown = markdown.replace("](overview.md", "](index.md")
    for line, code in zip(*(one + [end] for one, end in zip(as_python_markdown(markdown), ("", 0)))):
        if code:
            block.append(line)
            depth = code - 4
            continue
        if block:
            made = formulas.block(block) if name in FORMULAS else None
            lines += [" " * depth + made] if made else block
            block = []
        fenced ^= line.startswith("```")
        lines.append(line if fenced or line.startswith(("```", "#")) else prose(line, name, docs))
    return "\n".join(lines)


def prose(line, name, docs):
    return with_links(with_formulas(line) if name in IN_TEXT else line, docs)


def with_newest_fonts(site):
    """Leaves each font of the theme in one format, WOFF2, and says so in its styles."""
    def newest(sources):
        kept = re.search(r"url\([^)]*\.woff2[^)]*\) *format\([^)]*\)", sources[0])
        return f"src:{kept[0]}{sources['end']}" if kept else ""

    fonts = [file for name in FONTS for file in (site / name).glob("*")]
    assert any(file.suffix == ".woff2" for file in fonts), f"{site}: the theme's fonts are elsewhere"
    for file in fonts:
        if file.suffix in OLD_FONTS:
            file.unlink()
    for style in (site / "css").glob("*.css"):
        text = style.read_text(encoding="utf-8")
        if "@font-face" in text:
            style.write_text(re.sub(r"src:[^;}]*(?P<end>;?)", newest, text), encoding="utf-8")


def on_post_build(config):
    site = pathlib.Path(config["site_dir"])
    search = site / "search"
    found = json.loads((search / "search_index.json").read_text(encoding="utf-8"))["docs"]
    # A page of its own repeats what its sections have; a heading right above another one leads to nothing.
    pages = {one["location"]: one["title"] for one in found}
    sections = [[one["location"], pages[one["location"].split("#")[0]], one["title"], one["text"]]
                for one in found if "#" in one["location"] and one["text"].strip()]
    for file in search.iterdir():
        if file.name != "lunr.js":
            file.unlink()
    words = json.dumps(sections, ensure_ascii=False, separators=(",", ":")).replace("</", "<\\/")
    (search / "index.js").write_text(f"const searchIndex = {words};\n", encoding="utf-8")
    for name, place in (("search.js", search / "main.js"), ("find.js", search / "find.js"), ("kerf.css", site / "css" / "kerf.css")):
        place.write_text((HERE / name).read_text(encoding="utf-8"), encoding="utf-8")
    with_newest_fonts(site)
    for file in (*site.glob("sitemap.xml*"), *site.glob("*/*.map")):  # for servers, and for the theme's authors
        file.unlink()
