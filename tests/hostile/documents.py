"""Whether a document holds what somebody asked to have in it: its text, read back by other programs."""

import csv
import html.parser
import io
import re
import subprocess
import tomllib

CHUNK = 12  # letters that are looked for at a time
MOST_CUT = 3  # chunks that a page break, a page's head or a column may cut, a page


def asked_texts(path, document):
    """The texts of an ask.toml that such a document of its results shows."""
    try:
        ask = tomllib.loads(path.read_text())
    except (ValueError, OSError):
        return []
    texts = []
    if document.suffix == ".pdf":
        texts = [text for text in ask.get("certificate", {}).values() if isinstance(text, str)]
    for kind in ("point", "plane", "eye"):
        items = ask.get(kind, [])
        texts += [item["name"] for item in items if isinstance(item, dict) and isinstance(item.get("name"), str)]
    return texts


def letters(text):
    """What no layout, escape or font changes: ASCII letters and digits."""
    return re.sub(r"[^A-Za-z0-9]", "", text)


def text_of_pdf(path):
    read = subprocess.run(["pdftotext", "-layout", path, "-"], capture_output=True)
    return read.stdout.decode("utf8", "replace") if read.returncode == 0 else None


class TextOfPage(html.parser.HTMLParser):
    def __init__(self, source):
        super().__init__()
        self.texts = []
        self.feed(source)

    def handle_data(self, data):
        self.texts.append(data)


def text_lost(shown, texts, pages=1):
    """The texts of which some is not in `shown`."""
    stream, lost = letters(shown), []
    for text in texts:
        wanted = letters(re.sub(r"[\x00-\x1f\x7f-\x9f]", "", text))
        chunks = [wanted[k : k + CHUNK] for k in range(0, len(wanted), CHUNK)]
        missing = sum(chunk not in stream for chunk in chunks)
        if missing > MOST_CUT * pages * (len(chunks) > 3) or stream.count("A" * CHUNK) * CHUNK < wanted.count("A" * CHUNK):
            lost.append(text[:40])
    return lost


OBEYED = "[\u200e\u200f\u061c\u202a-\u202e\u2066-\u2069]"


def is_formula(cell):
    if cell[:1] not in ("=", "+", "-", "@", "\t", "\r"):
        return False
    return re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?(nan|inf)", cell) is None


def complaints(path, texts):
    """What is wrong with a document at `path`, which should show the texts."""
    if path.suffix == ".pdf":
        shown = text_of_pdf(path)
        if shown is None:
            return ["a PDF that pdftotext cannot read"]
        return [f"text lost: {text!r}" for text in text_lost(shown, texts, shown.count("\f"))]
    source = path.read_bytes().decode("utf8", "replace")
    wrong = []
    if path.suffix in (".html", ".csv") and re.search(OBEYED, source):
        wrong.append(f"bidirectional characters in {path.name}")
    if path.suffix == ".html":
        shown = "".join(TextOfPage(source).texts)
        wrong += [f"text lost: {text!r}" for text in text_lost(shown, texts)]
    if path.suffix == ".csv":
        cells = [cell for row in csv.reader(io.StringIO(source, newline="")) for cell in row]
        wrong += [f"a formula: {cell[:40]!r}" for cell in cells if is_formula(cell)]
    return wrong
