"""Plans, labs and scenes as dicts, written as the TOML that the program reads."""

import json
import pathlib
import re

# Keys whose values are files. TOML of ours names them relative to itself; in a dict they are relative to where one is.
_FILES = {"file", "tables", "texture", "normal_texture", "metallic_roughness_texture"}


def _text(text):
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(key):
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)


def _value(key, value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (str, pathlib.Path)):
        text = str(value)
        if key in _FILES:
            text = str(pathlib.Path(text).absolute())
        return _text(text)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(key, one) for one in value) + "]"
    if hasattr(value, "tolist"):  # of numpy
        return _value(key, value.tolist())
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    raise TypeError(f"{key}: {value!r} has no place in a TOML file")


def _is_array_of_tables(value):
    return isinstance(value, (list, tuple)) and len(value) > 0 and all(isinstance(one, dict) for one in value)


def dumps(table, path=()):
    """A dict as TOML: dicts are [tables], lists of dicts [[arrays of tables]]; None is left out."""
    lines, below = [], []
    for key, value in table.items():
        if value is None:
            continue
        if isinstance(value, dict):
            name = ".".join((*path, _key(key)))
            below.append(f"\n[{name}]\n" + dumps(value, (*path, _key(key))))
        elif _is_array_of_tables(value):
            name = ".".join((*path, _key(key)))
            below += [f"\n[[{name}]]\n" + dumps(one, (*path, _key(key))) for one in value]
        else:
            lines.append(f"{_key(key)} = {_value(key, value)}\n")
    return "".join(lines) + "".join(below)
