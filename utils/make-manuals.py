#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Writes manual pages and what bash and zsh complete, from the tools' own tables.

  make-manuals.py --out FOLDER TOOL...

Each tool says with --help-json which options it has. Those whose options LLVM reads
have many more, which their --help-all prints. Of a tool there are OUT/man1/TOOL.1.gz,
OUT/bash/TOOL and OUT/zsh/_TOOL. The same tools give the same bytes.
"""

import argparse
import gzip
import json
import pathlib
import re
import subprocess

from tool import run_main

FILES = ("FILE", "IMAGE", "SCENE", "PIPELINE", "REFERENCE", "CAPTURE")
LLVM_OPTION = re.compile(r"^ +(--?[A-Za-z][\w.-]*)(\[?=<[^>]*>\]?)? +- +(.*)$")
LICENCE = "SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception"


def call(*words):
    return subprocess.run([str(it) for it in words], check=True, capture_output=True, text=True).stdout


def read_table(path):
    table = json.loads(call(path, "--help-json"))
    if table["llvm"]:
        known = {name for option in table["options"] for name in option["names"]}
        for line in call(path, "--help-all").splitlines():
            if (found := LLVM_OPTION.match(line)) and found[1] not in known:
                known.add(found[1])
                table["options"].append({
                    "names": [found[1]], "value": found[2] or "", "group": "Passes and options",
                    "description": found[3].strip(), "choices": [], "positional": False,
                    "takes_value": (found[2] or "").startswith("=")})
        for option in table["options"]:
            option["group"] = option["group"] or "Options"
            option["description"] = option["description"] or option.get("brief", "")
    return table


# --- Manual pages -----------------------------------------------------------------


def roff(text):
    """Text as roff has it: no line begins with a request."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"^([.'])", r"\\&\1", text, flags=re.M)


def describe_option(option):
    names = ", ".join(f"\\fB{roff(name)}\\fR" for name in option["names"])
    value = option["value"]
    if value:
        names += ("" if value[0] in "[=" else " ") + f"\\fI{roff(value)}\\fR"
    yield from (".TP", names, roff(option["description"]))
    for choice in option["choices"]:
        yield from (".RS", ".TP", f"\\fB{roff(choice['word'])}\\fR", roff(choice["description"]), ".RE")


def write_manual(table):
    name = table["name"]
    summary = re.split(r"\. |\.$", table["description"])[0]
    lines = [f'.\\" {LICENCE}', f'.TH {name.upper()} 1 "" "Piko {table["version"]}" "Piko"',
             ".SH NAME", f"{roff(name)} \\- {roff(summary[0].lower() + summary[1:])}",
             ".SH SYNOPSIS", ".nf", roff(table["usage"]), ".fi",
             ".SH DESCRIPTION", roff(table["description"])]
    if table["example"]:
        lines += [".SH EXAMPLE", ".nf", roff(table["example"]), ".fi"]
    for group in dict.fromkeys(option["group"] for option in table["options"]):
        lines.append(f".SH {roff(group.upper())}")
        for option in table["options"]:
            if option["group"] == group:
                lines += describe_option(option)
    lines += [".SH SEE ALSO", "The documents are in /usr/share/doc/piko where piko\\-doc "
              "is installed, or share/doc/piko beside the tools."]
    return "\n".join(lines) + "\n"


# --- Completion ---------------------------------------------------------------------


def kind_of(option):
    """What completes a value: words, "files", "folders", or nothing."""
    if option["choices"]:
        return " ".join(choice["word"] for choice in option["choices"])
    word = re.split(r"[^A-Z]", option["value"].lstrip("[=<"))[0] or option["names"][0]
    return "files" if word in FILES else "folders" if word == "FOLDER" else ""


BASH = """# {licence}
# Completes the command lines of {name}; made by utils/make-manuals.py.
{function}() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before='' option='' kind=files
  ((COMP_CWORD > 1)) && before=${{COMP_WORDS[COMP_CWORD - 1]}}
  # bash parts --option=value into three words.
  if [[ $word == = ]]; then
    option=$before word=''
  elif [[ $before == = && COMP_CWORD -gt 2 ]]; then
    option=${{COMP_WORDS[COMP_CWORD - 2]}}
  elif [[ $before == -* ]]; then
    option=$before
  fi
  case $option in
{cases}  esac
  case $kind in
    files) mapfile -t COMPREPLY < <(compgen -f -- "$word") ;;
    folders) mapfile -t COMPREPLY < <(compgen -d -- "$word") ;;
    *) mapfile -t COMPREPLY < <(compgen -W "$kind" -- "$word") ;;
  esac
  if [[ $word == -* && $kind == files ]]; then
    mapfile -t COMPREPLY < <(compgen -W "{options}" -- "$word")
  fi
}}
complete -o filenames -F {function} {name}
"""


def write_bash(table):
    cases, options = "", []
    for option in table["options"]:
        if option["positional"]:
            continue
        options += option["names"]
        if option["takes_value"]:
            patterns = " | ".join(option["names"])
            cases += f"    {patterns}) kind='{kind_of(option)}' ;;\n"
    return BASH.format(licence=LICENCE, name=table["name"], cases=cases,
                       function="_" + table["name"].replace("-", "_"), options=" ".join(options))


def zsh_quote(text):
    return text.replace("'", "'\\''").replace("[", "\\[").replace("]", "\\]").replace(":", "\\:")


def write_zsh(table):
    lines = []
    for option in table["options"]:
        kind = kind_of(option)
        action = {"files": "_files", "folders": "_files -/", "": " "}.get(kind, f"({kind})")
        what = zsh_quote(option["value"].strip("[]=<>") or "value")
        if option["positional"]:
            lines.append(f"'*:{zsh_quote(option['names'][0])}:_files'")
            continue
        text = zsh_quote(option.get("brief") or option["description"])
        for name in option["names"]:
            value = ""
            if option["takes_value"]:
                separator = "=" if name.startswith("--") else "+"
                optional = ":" if option["value"].startswith("[") else ""
                separator = "=-" if optional else separator
                value = f"{separator}"
                lines.append(f"'*{name}{value}[{text}]{optional}:{what}:{action}'")
            else:
                lines.append(f"'*{name}[{text}]'")
    if not any(option["positional"] for option in table["options"]):
        lines.append("'*:FILE:_files'")
    body = " \\\n  ".join(dict.fromkeys(lines))
    return f"#compdef {table['name']}\n# {LICENCE}\n_arguments \\\n  {body}\n"


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, type=pathlib.Path, help="where to write")
    parser.add_argument("tools", nargs="+", metavar="TOOL", type=pathlib.Path)
    arguments = parser.parse_args()
    for tool in arguments.tools:
        table = read_table(tool.absolute())
        name = tool.name
        page = write_manual(table)
        if name != table["name"]:  # which it says it is
            page = f".so man1/{table['name']}.1\n"
        table["name"] = name
        manual = gzip.compress(page.encode(), mtime=0)
        for path, content in [(f"man1/{name}.1.gz", manual), (f"bash/{name}", write_bash(table).encode()),
                              (f"zsh/_{name}", write_zsh(table).encode())]:
            file = arguments.out / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)


if __name__ == "__main__":
    run_main(main)
