"""What `luxfield --help` and `luxfield VERB --help` say, as data; the man pages and completions are made from it."""

import dataclasses
import re
import subprocess

# "  -o,--output TEXT REQUIRED   What it is": what it is begins at this column, on the next line where names are longer.
_COLUMN = 38
_MORE = " " * _COLUMN
_SECTIONS = ("Positionals", "Options", "Subcommands")


@dataclasses.dataclass
class Entry:
    names: list  # ["-o", "--output"], or one word of a positional or a verb
    value: str = ""  # "TEXT REQUIRED"; empty for a flag
    text: str = ""

    @property
    def choices(self):
        """The words to choose from, where there are such."""
        found = re.search(r"\{([^}]*)\}", self.value)
        return found[1].split(",") if found else []

    @property
    def takes_file(self):
        return self.value.startswith("TEXT") and not self.choices


@dataclasses.dataclass
class Help:
    words: list  # ["luxfield", "calibrate", "sensor"]
    description: str = ""
    usage: str = ""
    sections: dict = dataclasses.field(default_factory=dict)  # {"Options": [Entry, ...], ...}
    notes: dict = dataclasses.field(default_factory=dict)  # {"Knobs": [line, ...], ...}: tables as they are printed
    footer: list = dataclasses.field(default_factory=list)

    @property
    def options(self):
        return self.sections.get("Options", [])

    @property
    def verbs(self):
        return self.sections.get("Subcommands", [])


def _parse(words, text):
    page = Help(list(words))
    section = None
    lines = text.splitlines()
    for line, following in zip(lines, [*lines[1:], ""]):
        if line.startswith("Exit codes:"):
            section = page.footer
        if section is page.footer:
            page.footer.append(line)
        elif line.startswith("Usage: "):
            page.usage = line[len("Usage: "):]
        elif re.match(r"^\S.*:$", line):
            where = page.sections if line[:-1] in _SECTIONS else page.notes
            section = where.setdefault(line[:-1], [])
        elif section is None:
            page.description = f"{page.description} {line}".strip()
        elif any(section is lines for lines in page.notes.values()):
            section.append(line)
        elif line.startswith(_MORE):
            section[-1].text = f"{section[-1].text} {line.strip()}".strip()
        elif line.strip():
            names = line if following.startswith(_MORE) else line[:_COLUMN]
            names, _, value = names.strip().partition(" ")
            text = "" if following.startswith(_MORE) else line[_COLUMN:]
            section.append(Entry(names.split(","), value.strip(), text.strip()))
    return page


def _page(program, words):
    said = subprocess.run([program, *words, "--help"], text=True, capture_output=True, check=True).stdout
    return _parse(["luxfield", *words], said)


def pages(program, words=()):
    """The Help of the program, or of the verb that `words` name, and of all verbs in it."""
    page = _page(program, words)
    yield page
    for verb in page.verbs:
        yield from pages(program, (*words, verb.names[0]))
