# SPDX-License-Identifier: Apache-2.0
"""Hooks of mkdocs. The first page of the site is README, with its links seen from docs/.

The site works from a folder, without a server, and omits what no page uses. A browser loads no JSON from a folder, so the
search of mkdocs finds nothing there. The index becomes a script, and search.js beside this file searches it."""
import json
import pathlib
import re
import tempfile

from mkdocs.structure.files import File

HERE = pathlib.Path(__file__).parent
# Formats of the one font for browsers that are older than ten years.
OLD_FONTS = (".eot", ".svg", ".ttf", ".otf", ".woff")


def on_files(files, config):
    readme = (pathlib.Path(config["docs_dir"]).parent / "README.md").read_text(encoding="utf-8")
    page = re.sub(r"\]\(docs/", "](", readme)
    page = re.sub(r"\[(`[^`\]]+`)\]\([A-Z]+\.md\)", r"\1", page)  # a file that is no page of the site
    folder = tempfile.mkdtemp()  # mkdocs reads it when it builds
    pathlib.Path(folder, "index.md").write_text(page, encoding="utf-8")
    files.append(File("index.md", folder, config["site_dir"], config["use_directory_urls"]))
    return files


def on_post_build(config):
    site = pathlib.Path(config["site_dir"])
    search = site / "search"
    found = json.loads((search / "search_index.json").read_text(encoding="utf-8"))["docs"]
    # A page of its own repeats what its sections have.
    pages = {one["location"]: one["title"] for one in found}
    sections = [[one["location"], pages[one["location"].split("#")[0]], one["title"], one["text"]]
                for one in found if "#" in one["location"]]
    for file in search.iterdir():
        file.unlink()
    words = json.dumps(sections, ensure_ascii=False, separators=(",", ":")).replace("</", "<\\/")
    (search / "index.js").write_text(f"const searchIndex = {words};\n", encoding="utf-8")
    (search / "main.js").write_text((HERE / "search.js").read_text(encoding="utf-8"), encoding="utf-8")
    for file in (site / "fonts").iterdir():
        if file.suffix in OLD_FONTS:
            file.unlink()
    style = site / "css" / "font-awesome.min.css"
    face = "src:url('../fonts/fontawesome-webfont.woff2') format('woff2');"
    text, count = re.subn(r"src:url\('\.\./fonts/fontawesome-webfont\.eot[^;]*;src:[^;]*;", face, style.read_text(encoding="utf-8"))
    assert count == 1, f"{style}: its font is named otherwise"
    style.write_text(text, encoding="utf-8")
    for name in ("sitemap.xml", "sitemap.xml.gz"):  # for servers
        (site / name).unlink(missing_ok=True)
