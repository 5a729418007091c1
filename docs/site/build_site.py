#!/usr/bin/python3 -B
"""The documentation site: build_site.py PROGRAM FOLDER makes FOLDER/site with mkdocs, from docs/, from what the program
says of itself and from the comments of public headers. Pages link to each other; links to other files of the tree become
plain text."""

import pathlib
import re
import shutil
import subprocess
import sys

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "packaging"))
import notebooks  # noqa: E402
import verbs_help  # noqa: E402

RENAMED = {"CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md", "docs/README.md": "index.md"}
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)\s]+)\)", re.S)


def site_path(path):
    """Where a page of the tree lies in the site; None for what is no page of it."""
    name = path.relative_to(ROOT).as_posix()
    if name in RENAMED:
        return RENAMED[name]
    if name.startswith("docs/") and not name.startswith("docs/site/"):
        return name.removeprefix("docs/")
    if name.startswith("python/examples/"):
        return f"examples/{path.stem}.md"
    return None


def relinked(text, source, target):
    """`text` of the page `source` with links as they are from `target` in the site."""

    def replace(match):
        words, link = match.groups()
        if link.startswith(("http:", "https:", "#")):
            return match[0]
        name, _, anchor = link.partition("#")
        path = (source.parent / name).resolve()
        if path.is_dir():
            path = path / "README.md"
        page = site_path(path) if path.exists() else None
        if page is None:
            return words
        up = "../" * target.count("/")
        return f"[{words}]({up}{page}{'#' + anchor if anchor else ''})"

    return LINK.sub(replace, text)


def copy_pages(folder):
    """Every page and picture of docs/, and the two pages at the root."""
    for source in [*sorted((ROOT / "docs").rglob("*")), ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]:
        target = site_path(source) if source.is_file() else None
        if target is None:
            continue
        (folder / target).parent.mkdir(parents=True, exist_ok=True)
        if source.suffix == ".md":
            (folder / target).write_text(relinked(source.read_text(), source, target))
        else:
            shutil.copy(source, folder / target)


def write_home(folder):
    """README's picture and first sentences before the list of pages."""
    head = (ROOT / "README.md").read_text().split("\n## ")[0]
    head = relinked(head, ROOT / "README.md", "index.md").replace("](docs/", "](")
    pages = (folder / "index.md").read_text().replace("# Documentation\n", "## Documentation\n", 1)
    (folder / "index.md").write_text(head.rstrip() + "\n\n" + pages)


def cell(text):
    return text.replace("|", r"\|").replace("<", "&lt;")


def verb_page(page):
    lines = [f"# {' '.join(page.words)}\n", f"{page.description}.\n" if page.description else ""]
    lines.append(f"```\n{page.usage}\n```\n")
    for title, entries in page.sections.items():
        lines.append(f"## {title}\n\n| name | value | what it is |\n|---|---|---|")
        for entry in entries:
            names = ", ".join(f"`{name}`" for name in entry.names)
            if title == "Subcommands":
                names = f"[{names}]({'-'.join([*page.words[1:], entry.names[0]])}.md)"
            value = f"`{cell(entry.value)}`" if entry.value else ""
            lines.append(f"| {names} | {value} | {cell(entry.text)} |")
        lines.append("")
    for title, table in page.notes.items():
        lines.append(f"## {title}\n\n```\n" + "\n".join(table) + "\n```\n")
    above = f"[luxfield {page.words[1]}]({page.words[1]}.md)" if len(page.words) > 2 else "[All verbs](../../verbs.md)"
    return "\n".join(lines) + f"\n{above}\n"


def write_verbs(folder, program):
    (folder / "reference/verbs").mkdir(parents=True)
    names = []
    for page in verbs_help.pages(program):
        if len(page.words) == 1:
            continue
        name = f"reference/verbs/{'-'.join(page.words[1:])}.md"
        (folder / name).write_text(verb_page(page))
        names.append({" ".join(page.words[1:]): name})
    return names


def write_headers(folder):
    """A page for each room with the public headers that its CMakeLists.txt lists."""
    (folder / "reference/headers").mkdir(parents=True)
    names = []
    for lists in sorted(ROOT.glob("*/CMakeLists.txt")):
        listed = re.search(r"  HEADERS[^\n]*\n(.*?)  SOURCES", lists.read_text(), re.S)
        if not listed:
            continue
        room = lists.parent.name
        page = [f"# Headers of {room}\n"]
        for header in listed[1].split():
            page.append(f"## {room}/{header}\n\n```cpp\n{(lists.parent / header).read_text()}```\n")
        page.append("[The library](../../library.md)\n")
        (folder / f"reference/headers/{room}.md").write_text("\n".join(page))
        names.append({room: f"reference/headers/{room}.md"})
    return names


def write_examples(folder):
    """A page for each example of the Python module: its words and code, its picture and the notebook to download."""
    target = folder / "examples"
    target.mkdir()
    names = []
    for script in sorted((ROOT / "python/examples").glob("*.py")):
        shutil.copy(script, target / script.name)
        notebooks.write(script, target)
        (kind, head), *rest = notebooks.cells(script.read_text())
        page = [head, f"![What it draws](../images/examples/{script.stem}.png)",
                f"[{script.name}]({script.name}) · [as a notebook]({script.stem}.ipynb)"]
        page += [text if kind == "markdown" else f"```python\n{text}\n```" for kind, text in rest]
        page.append("[All examples](../examples.md)")
        (target / f"{script.stem}.md").write_text("\n\n".join(page) + "\n")
        names.append({head.splitlines()[0].removeprefix("# ").split(":")[0]: f"examples/{script.stem}.md"})
    return names


def formats(folder):
    names = []
    for page in sorted((folder / "formats").glob("*.md")):
        title = re.search(r"^# (.*)$", page.read_text(), re.M)[1].replace("`", "")
        names.append({title: f"formats/{page.name}"})
    return names


def filled(nav, made):
    if isinstance(nav, list):
        return [filled(entry, made) for entry in nav]
    if isinstance(nav, dict):
        return {title: filled(entry, made) for title, entry in nav.items()}
    return made.get(nav, nav)


def main(program, folder):
    folder = pathlib.Path(folder).resolve()
    pages = folder / "pages"
    shutil.rmtree(folder, ignore_errors=True)
    pages.mkdir(parents=True)
    copy_pages(pages)
    write_home(pages)
    shutil.copy(pathlib.Path(__file__).parent / "extra.css", pages / "extra.css")
    made = {"VERBS": write_verbs(pages, program), "HEADERS": write_headers(pages), "FORMATS": formats(pages),
            "EXAMPLES": write_examples(pages)}
    config = yaml.safe_load((pathlib.Path(__file__).parent / "mkdocs.yml").read_text())
    config |= {"docs_dir": str(pages), "site_dir": str(folder / "site"), "nav": filled(config["nav"], made)}
    (folder / "mkdocs.yml").write_text(yaml.safe_dump(config, sort_keys=False))
    subprocess.run(["mkdocs", "build", "--quiet", "--config-file", folder / "mkdocs.yml"], check=True)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
