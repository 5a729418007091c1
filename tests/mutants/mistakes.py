"""The mistakes that a line of code may be given."""

import dataclasses
import re

import source_text

# Statements whose change nobody could see, or only in the words of a message, or in speed.
NO_BEHAVIOUR = re.compile(
    r"\bthrow\b|Error\b|fmt::print|\bcerr\b|\bcout\b|[Ww]arn|\bNote\(|\bLog|[Pp]rogress"
    r"|\breserve\(|\bassert\b|static_assert|[Tt]hread|capacity|[Gg]rain|[Cc]hunk|[Bb]lock[Ss]ize|kBlockBytes|ccache|\busing\b|\btypedef\b"
    r"|\bconstexpr\b|lock_guard"
    r"|[Pp]roblem|\bplot\.(width|height)|option_defaults|\badd_subcommand|->check\("
    r"|notify_|RaisePriority|fflush|shrink|\.close\(|prefetch|Stopwatch|add_option|add_flag|printf"
)
NOT_DROPPED = re.compile(
    r"^(return|break|continue|if|for|while|else|do|switch|case|default|goto|delete|using|static|const"
    r"|auto|barrier|struct|class|enum|template|typename|namespace|public|private|friend|extern"
    r"|explicit|virtual)\b"
)


@dataclasses.dataclass
class Mistake:
    path: str
    line: int
    start: int  # of the text that is replaced
    end: int
    original: str
    mutated: str
    dropped: bool  # a whole statement is
    before: str  # what stands around it on its lines
    after: str

    def schema(self, number):
        """Both versions, of which the number chooses one. Lines stay where they are."""
        if self.dropped:
            return f"{{ if (!LUXFIELD_MUTANT({number})) {{ {self.original} }} }}"
        return f"(LUXFIELD_MUTANT({number}) ? ({one_line(self.mutated)}) : ({self.original}))"

    def change(self):
        """What survivors are known by: no line's number, which would go with every edit."""
        line = [one_line(self.before + text + self.after) for text in (self.original, self.mutated)]
        return f"{self.path}: {line[0]}  =>  {line[1] or 'nothing'}"


def one_line(text):
    return " ".join(text.split())


NEGATED = {"<": ">=", ">": "<=", "<=": ">", ">=": "<", "==": "!=", "!=": "=="}
SWAPPED = {"+": "-", "-": "+", "*": "/", "/": "*", "&&": "||", "||": "&&", **NEGATED}
OPERATOR = re.compile(r'(?<=[\w)\]}"\'] )(&&|\|\||[<>=!]=|[-+*/<>])(?=\s)')
NAMED = {
    "min": "max",
    "max": "min",
    "fmin": "fmax",
    "fmax": "fmin",
    "sin": "cos",
    "cos": "sin",
    "floor": "ceil",
    "ceil": "floor",
}
FUNCTION = re.compile(r"\b(min|max|fmin|fmax|sin|cos|floor|ceil)(?=(<[^<>()]*>)?\()")
NUMBER = re.compile(r"(?<![\w.<])(?<![pPeE][-+])(\d+\.\d*|\d+)(f?)(?![\w.>'])")
CONDITION = re.compile(r"\bif (\()")
CALL = re.compile(r"\b(?!(?:f?min|f?max|hypot|dot|Dot|swap)\()[A-Za-z_]\w*(\()")
BENCH = re.compile(r"\bbench_\w+\.cc$|^device_bench/main\.cc$")
LOOP = re.compile(r"\bfor (\()")


def other_number(number):
    """A number twice as large, an integer one more."""
    if "." not in number:
        return str(int(number) + 1)
    return repr(2 * float(number) or 1.0)


class Finder:
    def __init__(self, path, text):
        self.path, self.text, self.mask = path, text, source_text.masked(text)
        self.found = []
        self.loops = [
            (m.start(1), source_text.closing(self.mask, m.start(1)))
            for m in LOOP.finditer(self.mask)
        ]

    def add(self, at, start, end, mutated, dropped=False):
        original = self.text[start:end]
        s, e = source_text.statement(self.mask, at)
        context = self.mask[s:e] + self.mask[start:end]
        if (
            not original.strip()
            or "//" in original
            or "/*" in original
            or NO_BEHAVIOUR.search(context)
        ):
            return
        if len(original) > 400 or one_line(original) == one_line(mutated):
            return
        first, last = self.text.rfind("\n", 0, start) + 1, self.text.find("\n", end)
        self.found.append(
            Mistake(
                self.path,
                source_text.line_of(self.text, at),
                start,
                end,
                original,
                mutated,
                dropped,
                self.text[first:start],
                self.text[end:last],
            )
        )

    def edit(self, at, length, replacement):
        """The expression around an offset, with `length` characters there replaced."""
        start, end = source_text.expression(self.mask, at)
        if not start <= at < at + length <= end:
            return
        self.add(at, start, end, self.text[start:at] + replacement + self.text[at + length : end])

    def operators(self, begin, end):
        for m in OPERATOR.finditer(self.mask, begin, end):
            at = m.start(1)
            in_loop = any(a < at < b for a, b in self.loops)
            if in_loop and m[1] == "<":  # the last turn is left out
                start, stop = source_text.expression(self.mask, at)
                if "&&" not in self.mask[start:stop]:
                    self.add(
                        at, start, stop, self.text[start:at] + "+ 1 < " + self.text[at + 2 : stop]
                    )
            elif (
                not (in_loop and m[1] in NEGATED)
                and '"' not in self.mask[at - 2] + self.mask[at + len(m[1]) + 1]
            ):
                self.edit(at, len(m[1]), SWAPPED[m[1]])

    def numbers(self, begin, end):
        if BENCH.search(self.path):
            return  # how large and how often are choices
        for m in NUMBER.finditer(self.mask, begin, end):
            before = self.mask[: m.start()].rstrip()[-1:]
            if before in ("<", ":") or re.search(
                r"\bParallelFor\([^()]*$", self.mask[: m.start()][-80:]
            ):
                continue  # an argument of a template, a case, how work is shared out
            self.edit(m.start(), len(m[0]), other_number(m[1]) + m[2])

    def functions(self, begin, end):
        for m in FUNCTION.finditer(self.mask, begin, end):
            self.edit(m.start(), len(m[1]), NAMED[m[1]])

    def conditions(self, begin, end):
        for m in CONDITION.finditer(self.mask, begin, end):
            stop = source_text.closing(self.mask, m.start(1))
            initialised = self.mask.rfind(";", m.start(1), stop)
            if "{" in self.mask[m.start(1) : max(initialised, 0)]:
                initialised = -1  # it ends a statement of a lambda
            start = max(m.start(1), initialised) + 1
            original = self.text[start:stop]
            if "=" not in re.sub(r"[=!<>]=", "", self.mask[start:stop]):
                self.add(start, start, stop, f"!({original})")

    def orders(self, begin, end):
        for m in CALL.finditer(self.mask, begin, end):
            spans = source_text.arguments(self.mask, m.start(1))
            if not 2 <= len(spans) <= 4:
                continue
            (a, b), (c, d) = spans[:2]
            one, two = self.text[a:b], self.text[c:d]
            if re.fullmatch(r"[\w.\[\]>-]+", one) and re.fullmatch(r"[\w.\[\]>-]+", two):
                start, end = source_text.expression(self.mask, m.start())
                self.add(
                    m.start(), start, end, f"{self.text[start:a]}{two}, {one}{self.text[d:end]}"
                )

    def statements(self, begin, end):
        at = begin
        while 0 <= at < end:
            while at < end and (self.mask[at].isspace() or self.mask[at] in ";{}"):
                at += 1
            stop = self.mask.find(";", at, end)
            if stop < 0:
                return
            text = self.mask[at:stop]
            named = re.match(r"[\w.\[\]()*>-]+( [-+*/|&]?= |\(|\.|->)", text)
            if (
                named
                and not re.search(r"[{}]", text)
                and not NOT_DROPPED.match(text)
                and "++" not in text
            ):
                self.add(at, at, stop + 1, "", dropped=True)
                at = stop
            else:
                following = [p for p in (self.mask.find(c, at + 1, end) for c in ";{}") if p >= 0]
                at = min(following, default=end)

    def all(self):
        for begin, end in source_text.code_spans(self.mask):
            for kind in (
                self.operators,
                self.numbers,
                self.functions,
                self.conditions,
                self.orders,
                self.statements,
            ):
                kind(begin, end)
        return self.found


def in_text(path, text):
    """Every mistake for which there is room, in an order that the text alone decides."""
    return Finder(path, text).all()
