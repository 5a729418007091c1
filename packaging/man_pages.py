#!/usr/bin/env -S python3 -B
"""The man pages of the program and of every verb, compressed: man_pages.py PROGRAM VERSION FOLDER"""

import gzip
import pathlib
import sys

import verbs_help


def escaped(text):
    text = text.replace("\\", r"\e").replace("-", r"\-")
    return r"\&" + text if text.startswith((".", "'")) else text


def entry(item):
    names = ", ".join(rf"\fB{escaped(name)}\fR" for name in item.names)
    value = rf" \fI{escaped(item.value)}\fR" if item.value else ""
    return f".TP\n{names}{value}\n{escaped(item.text)}\n"


def troff(page, version, siblings):
    name = "-".join(page.words)
    lines = [f'.TH "{name.upper()}" 1 "" "luxfield {version}" "User Commands"\n']
    lines.append(f".SH NAME\n{escaped(name)} \\- {escaped(page.description.rstrip('.'))}\n")
    lines.append(f".SH SYNOPSIS\n.B {escaped(page.usage or ' '.join(page.words))}\n")
    for title, entries in page.sections.items():
        lines.append(f".SH {'VERBS' if title == 'Subcommands' else title.upper()}\n")
        lines += [entry(item) for item in entries]
    for title, table in page.notes.items():
        lines.append(f".SH {title.upper()}\n.nf\n" + "".join(escaped(line) + "\n" for line in table) + ".fi\n")
    if page.footer:
        lines.append(".SH EXIT STATUS\n" + escaped(" ".join(page.footer).removeprefix("Exit codes: ")) + "\n")
    if siblings:
        lines.append(".SH SEE ALSO\n" + ",\n".join(rf"\fB{escaped(other)}\fR(1)" for other in siblings) + "\n")
    return "".join(lines)


def write(pages, version, folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.1*"):  # of a verb that is no more
        old.unlink()
    for page in pages:
        below = ["-".join([*page.words, verb.names[0]]) for verb in page.verbs]
        above = ["-".join(page.words[:-1])] if len(page.words) > 1 else []
        text = troff(page, version, above + below)
        (folder / ("-".join(page.words) + ".1.gz")).write_bytes(gzip.compress(text.encode(), mtime=0))


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    write(list(verbs_help.pages(sys.argv[1])), *sys.argv[2:])
