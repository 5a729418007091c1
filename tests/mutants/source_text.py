"""Where code ends and begins in C++ and OpenCL C, as far as small changes of it need to know."""

import re

BRACKETS = {")": "(", "]": "[", "}": "{"}
KEYWORD = re.compile(r"\b(return|else|case)\W$")  # what may stand before an expression
# Blocks of code follow these; blocks of a namespace, a class or an initialiser follow others.
BEFORE_CODE = re.compile(
    r"(\)|\belse|\bdo|\btry|\bconst|\bnoexcept|\boverride|\bmutable|->[^;{}()]*)\s*$"
)


def masked(text):
    """The text with comments, literals' insides and preprocessor lines blank, offsets unchanged."""
    out = list(text)

    def blank(start, end):
        for i in range(start, end):
            if out[i] != "\n":
                out[i] = " "

    token = re.compile(
        r'//[^\n]*|/\*.*?\*/|R"(?P<tag>[^(\s]*)\(.*?\)(?P=tag)"|"(?:\\.|[^"\\\n])*"'
        r"|(?<![0-9a-fA-F])'(?:\\.|[^'\\\n])*'|^[ \t]*#(?:[^\n]*\\\n)*[^\n]*",
        re.S | re.M,
    )
    for found in token.finditer(text):
        literal = found[0][0] in "\"'R"
        blank(found.start() + literal, found.end() - literal)
        if literal:
            out[found.start()] = out[found.end() - 1] = '"'
    return "".join(out)


def code_spans(mask):
    """The outermost blocks of code: bodies of functions."""
    spans, stack = [], []
    inside = 0
    for i, c in enumerate(mask):
        if c == "{":
            is_code = inside > 0 or bool(BEFORE_CODE.search(mask[max(0, i - 80) : i]))
            stack.append((i, is_code))
            inside += is_code
        elif c == "}" and stack:
            start, is_code = stack.pop()
            inside -= is_code
            if is_code and inside == 0:
                spans.append((start + 1, i))
    return spans


def is_assignment(mask, i):
    """Whether the '=' there assigns or initialises (compound assignments too)."""
    if mask[i + 1] == "=" or mask[i - 1] in "=!":
        return False
    return mask[i - 1] not in "<>" or mask[i - 2] == mask[i - 1]


def expression(mask, at):
    """The widest operand around an offset: up to brackets, commas, assignments, ?, : and ;."""

    def stops(i):
        if KEYWORD.search(mask[max(0, i - 6) : i + 2]):
            return True
        c = mask[i]
        if c in ",;?":
            return True
        if c == ":":
            return mask[i - 1] != ":" and mask[i + 1] != ":"
        return c == "=" and is_assignment(mask, i)

    depth, start = 0, at
    while start > 0:
        c = mask[start - 1]
        if c in ")]}":
            depth += 1
        elif c in "([{":
            if depth == 0:
                break
            depth -= 1
        elif depth == 0 and stops(start - 1):
            break
        start -= 1
    depth, end = 0, at
    while end < len(mask):
        c = mask[end]
        if c in "([{":
            depth += 1
        elif c in ")]}":
            if depth == 0:
                break
            depth -= 1
        elif depth == 0 and stops(end):
            break
        end += 1
    start += len(mask[start:end]) - len(mask[start:end].lstrip())
    return start, start + len(mask[start:end].rstrip())


def closing(mask, opening):
    """The offset of the bracket that closes the one there; -1 if none does."""
    depth = 0
    for i in range(opening, len(mask)):
        if mask[i] in "([{":
            depth += 1
        elif mask[i] in ")]}":
            depth -= 1
            if depth == 0:
                return i
    return -1


def arguments(mask, opening):
    """The spans between the commas of a bracket."""
    end = closing(mask, opening)
    if end < 0:
        return []
    spans, depth, start = [], 0, opening + 1
    for i in range(opening + 1, end + 1):
        c = mask[i]
        if depth == 0 and (c == "," or i == end):
            lead = len(mask[start:i]) - len(mask[start:i].lstrip())
            spans.append((start + lead, start + len(mask[start:i].rstrip())))
            start = i + 1
        depth += (c in "([{") - (c in ")]}")
    return spans


def statement(mask, at):
    """The text between the semicolons and braces around an offset."""
    start = max(mask.rfind(c, 0, at) for c in ";{}") + 1
    ends = [e for e in (mask.find(c, at) for c in ";{}") if e >= 0]
    return start, min(ends, default=len(mask))


def line_of(text, at):
    return text.count("\n", 0, at) + 1
