#!/usr/bin/env -S python3 -B
"""Completions for bash, zsh and fish: completions.py PROGRAM FOLDER writes luxfield.bash, _luxfield and luxfield.fish"""

import pathlib
import re
import shlex
import sys

import verbs_help


def words_of(page):
    return [name for item in page.options for name in item.names] + [verb.names[0] for verb in page.verbs]


def key(page):
    return " ".join(page.words[1:])


def bash(pages):
    cases = []
    for page in pages:
        chosen = []
        for item in page.options:
            if item.choices:
                names = "|".join(item.names)
                chosen.append(f"        {names}) COMPREPLY=($(compgen -W {shlex.quote(' '.join(item.choices))} -- \"$word\")); return ;;\n")
            elif item.takes_file:
                chosen.append(f"        {'|'.join(item.names)}) COMPREPLY=($(compgen -f -- \"$word\")); return ;;\n")
        inner = f"      case \"$before\" in\n{''.join(chosen)}      esac\n" if chosen else ""
        cases.append(f"    {shlex.quote(key(page))})\n{inner}      words={shlex.quote(' '.join(words_of(page)))} ;;\n")
    groups = "|".join(shlex.quote(key(page)) for page in pages if page.verbs and key(page))
    return f"""# Completion of luxfield for bash, made from its --help.
_luxfield() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} verb= words= k
  COMPREPLY=()
  if ((COMP_CWORD > 1)); then verb=${{COMP_WORDS[1]}}; fi
  case "$verb" in
    {groups}) if ((COMP_CWORD > 2)); then verb+=" ${{COMP_WORDS[2]}}"; fi ;;
  esac
  case "$verb" in
{''.join(cases)}  esac
  if [[ $word == -* || -z $verb || $words != *--* ]]; then
    COMPREPLY=($(compgen -W "$words" -- "$word"))
  else
    COMPREPLY=($(compgen -W "$(printf '%s\\n' $words | grep -v '^-')" -- "$word") $(compgen -f -- "$word"))
  fi
}}
complete -o filenames -F _luxfield luxfield
"""


def described(text, most=70):
    text = re.sub(r"\s+", " ", text)
    return text if len(text) <= most else text[: most - 1].rsplit(" ", 1)[0] + "…"


def zsh(pages):
    def quoted(text):
        return text.replace("\\", r"\\").replace("'", "'\\''").replace("[", r"\[").replace("]", r"\]").replace(":", r"\:")

    functions = []
    for page in pages:
        name = "_luxfield" + "".join("_" + word.replace("-", "_") for word in page.words[1:])
        arguments = []
        for item in page.options:
            for option in item.names:
                what = f"[{quoted(described(item.text))}]"
                if item.choices:
                    arguments.append(f"'{option}{what}:value:({' '.join(item.choices)})'")
                elif item.value:
                    arguments.append(f"'{option}{what}:value:{'_files' if item.takes_file else ''}'")
                else:
                    arguments.append(f"'{option}{what}'")
        if page.verbs:
            verbs = " ".join(f"'{verb.names[0]}:{quoted(described(verb.text))}'" for verb in page.verbs)
            calls = "\n".join(
                f"        {verb.names[0]}) {name}_{verb.names[0].replace('-', '_')} ;;" for verb in page.verbs
            )
            functions.append(
                f"{name}_verbs() {{\n  local -a verbs=({verbs})\n  _describe verb verbs\n}}\n"
                f"{name}() {{\n  local state line\n  _arguments -C {' '.join(arguments)} '1:verb:{name}_verbs' '*::word:->words'\n"
                f"  if [[ $state == words ]]; then\n      case $line[1] in\n{calls}\n      esac\n  fi\n}}\n"
            )
        else:
            functions.append(f"{name}() {{\n  _arguments {' '.join(arguments)} '*:file:_files'\n}}\n")
    return "#compdef luxfield\n# Completion of luxfield for zsh, made from its --help.\n" + "".join(functions) + '_luxfield "$@"\n'


def fish(pages):
    lines = ["# Completion of luxfield for fish, made from its --help.\n"]
    for page in pages:
        seen = page.words[1:]
        if seen:
            condition = "; and ".join(f"__fish_seen_subcommand_from {word}" for word in seen)
        else:
            condition = "__fish_use_subcommand"
        for verb in page.verbs:
            inner = condition
            if seen:
                inner += "; and not __fish_seen_subcommand_from " + " ".join(v.names[0] for v in page.verbs)
            lines.append(f"complete -c luxfield -f -n '{inner}' -a {verb.names[0]} -d {shlex.quote(described(verb.text))}\n")
        for item in page.options:
            names = " ".join(f"-l {n[2:]}" if n.startswith("--") else f"-s {n[1:]}" for n in item.names)
            value = f" -x -a {shlex.quote(' '.join(item.choices))}" if item.choices else " -r" if item.value else ""
            lines.append(f"complete -c luxfield -n '{condition}' {names}{value} -d {shlex.quote(described(item.text))}\n")
    return "".join(lines)


def write(pages, folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "luxfield.bash").write_text(bash(pages))
    (folder / "_luxfield").write_text(zsh(pages))
    (folder / "luxfield.fish").write_text(fish(pages))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    write(list(verbs_help.pages(sys.argv[1])), *sys.argv[2:])
