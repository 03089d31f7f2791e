"""TAB in bash, zsh and fish: what each shell is taught, and what it is answered.

The shell hands over the line up to the cursor, in ``HRCNEURO_LINE``; it is answered with a line an offer, the word and,
behind a tab, its meaning. Quoting is the shell's own matter: zsh and fish do it; bash does not, so for bash it is done
here. Nothing offered means a file, which each shell completes itself; so does a tab alone, beside what is offered.
"""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import sys
from pathlib import Path
from typing import Any

from hrcneuro.cli import completion

SCRIPTS = {
    "bash": r"""
_hrcneuro() {
    local offer files=
    COMPREPLY=()
    while IFS= read -r offer; do
        if [[ $offer == $'\t' ]]; then files=yes; else COMPREPLY+=("$offer"); fi
    done < <(_HRCNEURO_COMPLETE=bash HRCNEURO_LINE="${COMP_LINE:0:COMP_POINT}" "$1" 2>/dev/null)
    # What goes on behind = or . gets no space.
    if [[ ${#COMPREPLY[@]} -gt 0 && ${COMPREPLY[0]} == *[=.] ]]; then compopt -o nospace; fi
    # Where nothing is offered, bash completes files itself.
    if [[ $files && ${#COMPREPLY[@]} -gt 0 ]]; then
        compopt -o filenames
        while IFS= read -r offer; do COMPREPLY+=("$offer"); done < <(compgen -f -- "${COMP_WORDS[COMP_CWORD]}")
    fi
}
complete -o default -F _hrcneuro hrcneuro
""",
    "zsh": r"""
#compdef hrcneuro
_hrcneuro() {
    local offer files line="${(j: :)words[1,CURRENT]}"
    local -a open openly done doing
    for offer in "${(@f)$(_HRCNEURO_COMPLETE=zsh HRCNEURO_LINE="$line" "${words[1]}" 2>/dev/null)}"; do
        [[ -z $offer ]] && continue
        [[ $offer == $'\t' ]] && files=yes && continue
        if [[ ${offer%%$'\t'*} == *[=.] ]]; then
            open+=("${offer%%$'\t'*}"); openly+=("${offer/$'\t'/  }")
        else
            done+=("${offer%%$'\t'*}"); doing+=("${offer/$'\t'/  }")
        fi
    done
    (( $#open )) && compadd -l -S '' -d openly -a open
    (( $#done )) && compadd -l -d doing -a done
    if [[ $files ]] || (( ! $#open && ! $#done )); then
        # The file begins behind the = of stage.key=file and --option=file.
        [[ $PREFIX == --*=* || ${words[CURRENT-1]} == --set ]] && compset -P 1 '*='
        _files
    fi
}
compdef _hrcneuro hrcneuro
""",
    "fish": r"""
complete -c hrcneuro -a '(_HRCNEURO_COMPLETE=fish HRCNEURO_LINE=(commandline -cp) hrcneuro 2>/dev/null)'
""",
}
_PLACES = {
    # .bashrc: where the package bash-completion, which looks into that folder, is not installed.
    "bash": (".local/share/bash-completion/completions/hrcneuro", ".bashrc"),
    "zsh": (".zfunc/_hrcneuro.zsh", ".zshrc"),
    "fish": (".config/fish/completions/hrcneuro.fish", ""),
}


def teach(*, install: bool) -> int:
    """Print what the shell of this terminal is to be taught, or put it where the shell looks; return the exit code."""
    shell = Path(os.environ.get("SHELL", "")).name
    if shell not in SCRIPTS:
        print(
            f"error: the shell {shell or 'of this terminal'} is not known; known: {', '.join(SCRIPTS)}", file=sys.stderr
        )
        print("  cure: SHELL=bash hrcneuro --show-completion prints the words for bash", file=sys.stderr)
        return 2
    script = SCRIPTS[shell].lstrip("\n")
    if not install:
        print(script, end="")
        return 0
    name, startup = _PLACES[shell]
    place = Path.home() / name
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(script, encoding="utf-8")
        if startup:
            _read_at_start(Path.home() / startup, place)
    except OSError as error:
        print(f"error: {error.filename}: {error.strerror}", file=sys.stderr)
        print("  cure: hrcneuro --show-completion prints what to put into the shell's startup file", file=sys.stderr)
        return 2
    print(f"{shell} knows hrcneuro from the next terminal on ({place})")
    return 0


def _read_at_start(startup: Path, place: Path) -> None:
    """Let a shell's startup file read the script, if it does not yet."""
    text = startup.read_text(encoding="utf-8") if startup.exists() else ""
    line = f"source {shlex.quote(str(place))}"
    if startup.name == ".zshrc":
        line = f"(( $+functions[compdef] )) || {{ autoload -Uz compinit && compinit }}; {line}"
    if line not in text:
        startup.write_text(f"{text}{'' if not text or text.endswith(chr(10)) else chr(10)}{line}\n", encoding="utf-8")


def offer(app: Any, shell: str) -> int:
    """Print what may stand at the end of the line that a shell has handed over; whatever is wrong offers nothing."""
    line = os.environ.pop("HRCNEURO_LINE", "")
    try:
        args, word = split(line)
        offered = _offered(app, args, word)
    except Exception:
        # A mistake in the line, or in a configuration, must not print over what somebody is typing.
        return 0
    for text, help in offered:
        if text.endswith(completion.FILES):
            # fish adds files by itself.
            print(end="" if shell == "fish" else f"{completion.FILES}\n")
        elif shell == "bash":
            print(_for_bash(text, word))
        else:
            print(f"{text}\t{' '.join(help.split())}" if help else text)
    return 0


def split(line: str) -> tuple[list[str], str]:
    """Return the arguments of a line behind the command's name, and the word at its end, which may be unfinished."""
    lexer = shlex.shlex(line, posix=True)
    lexer.whitespace_split = True
    lexer.commenters = ""
    words: list[str] = []
    try:
        words.extend(lexer)
        begun = bool(line) and not line[-1].isspace()
    except ValueError:
        # An open quote: what is in it so far is the word.
        words.append(str(lexer.token))
        begun = True
    return (words[1:-1], words[-1]) if begun and len(words) > 1 else (words[1:], "")


def _offered(app: Any, args: list[str], word: str) -> list[tuple[str, str]]:
    from typer.main import get_command

    command = get_command(app)
    # Typer brings a Click of its own, in later versions.
    own = "typer._click.shell_completion"
    base: Any = importlib.import_module(own if importlib.util.find_spec("typer._click") else own.partition("_")[2])

    class Offers(base.ShellComplete):
        def source_vars(self) -> dict[str, Any]:
            return {}

        def get_completion_args(self) -> tuple[list[str], str]:
            return args, word

        def format_completion(self, item: Any) -> str:
            return str(item.value)

    items = Offers(command, {}, "hrcneuro", "").get_completions(list(args), word)
    # Of --option=value, the value alone is offered; the shells put in whole words.
    option, equals, _ = word.partition("=")
    before = f"{option}=" if equals and option.startswith("--") else ""
    return [(f"{before}{item.value}", item.help or "") for item in items if item.type == "plain"]


def _for_bash(text: str, word: str) -> str:
    """Return an offer as bash puts it in: without what it keeps of the word (up to its last = or :), and quoted."""
    kept = max(word.rfind("="), word.rfind(":")) + 1
    return re.sub(r"([^\w@%+=:,./~{}\[\]-])", r"\\\1", text[kept:])
