#!/usr/bin/python3 -B
"""Examples as notebooks: notebooks.py SCRIPT.py ... -o FOLDER writes SCRIPT.ipynb for each.

A script is cut at its lines `# %%` into cells of code, and at `# %% [markdown]` into cells of text, whose lines begin
with `# `. The docstring becomes the first cell. In a notebook files go beside it, and progress is Python's.
"""

import argparse
import ast
import json
import pathlib

# What a script asks its command line for, and what stands for it in a notebook.
FOLDER = 'folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")'


def cells(script):
    """(kind, text) of each cell of a script's text: "markdown" or "code"."""
    words = ast.get_docstring(ast.parse(script))
    title, _, rest = words.partition("\n")
    found = [("markdown", f"# {title.rstrip('.')}\n{rest}".rstrip())]
    body = script.split("# %%", 1)[1]
    for part in body.split("\n# %%"):
        head, _, text = part.partition("\n")
        if head.strip() == "[markdown]":
            lines = [line.removeprefix("#").removeprefix(" ") for line in text.strip().splitlines()]
            found.append(("markdown", "\n".join(lines)))
        else:
            found.append(("code", text.strip().replace(FOLDER, 'folder = pathlib.Path(".")')))
    return [(kind, text) for kind, text in found if text]


def notebook(script):
    """The notebook (nbformat 4.5) of a script's text, as a dict."""
    made = []
    for k, (kind, text) in enumerate(cells(script)):
        cell = {"cell_type": kind, "id": f"cell-{k}", "metadata": {}, "source": text.splitlines(keepends=True)}
        if kind == "code":
            cell |= {"execution_count": None, "outputs": []}
        made.append(cell)
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"cells": made, "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}}, "nbformat": 4,
            "nbformat_minor": 5}


def write(script, folder):
    """Writes FOLDER/NAME.ipynb of the script NAME.py."""
    path = pathlib.Path(folder) / (pathlib.Path(script).stem + ".ipynb")
    path.write_text(json.dumps(notebook(pathlib.Path(script).read_text()), indent=1, ensure_ascii=False) + "\n")
    return path


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scripts", nargs="+")
    parser.add_argument("-o", "--output", default=".", help="folder of the notebooks (.)")
    options = parser.parse_args()
    for script in options.scripts:
        print(write(script, options.output))
