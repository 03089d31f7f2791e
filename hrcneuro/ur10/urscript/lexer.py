"""URScript's tokens, and where a program that arrives in pieces ends."""

from __future__ import annotations

import re
from typing import NamedTuple

_WORDS = """and break continue def elif else end enter_critical exit_critical False global halt if join kill local
not or pass return run sec thread True while xor"""
KEYWORDS = frozenset(_WORDS.split())
_TOKEN = re.compile(
    r"""(?P<blank>[ \t\r\f]+|\#[^\n]*)
      | (?P<newline>\n|;)
      | (?P<number>0[xX][0-9a-fA-F]+|0[bB][01]+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
      | (?P<string>"[^"\n]*"|'[^'\n]*')
      | (?P<pose>p\[)
      | (?P<name>[A-Za-z_][A-Za-z_0-9]*)
      | (?P<sign>==|!=|<=|>=|[-+*/%=<>!()\[\],:.$])""",
    re.VERBOSE | re.ASCII,
)
# What may not end a statement: it goes on in the next line, past comments.
_OPENING = "+ - * / % = == != < > <= >= , ( [ p[ and or not xor !"
_OPEN = frozenset(_OPENING.split())
_WORD = re.compile(r"\"[^\"\n]*\"|'[^'\n]*'|#[^\n]*|\b(def|sec|thread|while|if|end)\b")


_BYTE_ORDER_MARK = "\ufeff"  # what editors on Windows write first


class ScriptError(Exception):
    """A program that cannot be run, or cannot go on; the message names the line."""

    def __init__(self, message: str, *, line: int = 0, column: int = 0, code: str = "") -> None:
        """Keep the message; line and column count from 1, and ``code`` is the controller's own word for it."""
        super().__init__(message)
        self.line, self.column, self.code = line, column, code


class Token(NamedTuple):
    """One token: its kind (name, keyword, number, string, sign, newline, end of text), its text and its place."""

    kind: str
    text: str
    line: int
    column: int = 1


def wrong(token: Token, problem: str, code: str = "compile_error") -> ScriptError:
    """Return the error that a program has a ``problem`` at a token."""
    return ScriptError(f"line {token.line}: {problem}", line=token.line, column=token.column, code=code)


def tokens(script: str) -> list[Token]:
    """Return a script's tokens; newlines within brackets or after an operator are dropped.

    Raises:
        ScriptError: A character that belongs to no token.
    """
    tokens: list[Token] = []
    script = script.removeprefix(_BYTE_ORDER_MARK)
    at, line, depth, begin = 0, 1, 0, 0
    while at < len(script):
        match = _TOKEN.match(script, at)
        if match is None:
            raise wrong(Token("", "", line, at - begin + 1), f"unexpected character {script[at]!r}")
        kind, text = str(match.lastgroup), match.group()
        column, at = at - begin + 1, match.end()
        if kind == "newline":
            inside = depth > 0 or (tokens and tokens[-1].text in _OPEN and tokens[-1].kind != "string")
            if not inside and tokens and tokens[-1].kind != "newline":
                tokens.append(Token("newline", text, line, column))
            if text == "\n":
                line, begin = line + 1, at
        elif kind != "blank":
            depth += (text in ("(", "[", "p[")) - (text in (")", "]"))
            if kind == "pose":
                kind = "sign"
            elif kind == "name" and text in KEYWORDS:
                kind = "keyword"
            tokens.append(Token(kind, text, line, column))
    tokens.append(Token("newline", "\n", line))
    tokens.append(Token("eof", "", line))
    return tokens


class Splitter:
    """Cuts the stream of a script socket into programs: a ``def … end``, or a single line."""

    LIMIT = 1_000_000  # characters of one program; more is refused
    LINE = 100_000  # characters of one line

    def __init__(self) -> None:
        self._line = ""
        self._program: list[str] = []
        self._depth = self._size = 0

    def feed(self, text: str) -> list[str]:
        """Return the programs that ``text`` completes.

        Raises:
            ScriptError: A program without end that grows too large.
        """
        *lines, self._line = (self._line + text).replace("\r\n", "\n").split("\n")
        done = [program for line in lines if (program := self._add(line)) is not None]
        self._size += len(text)
        if self._size > self.LIMIT or len(self._line) > self.LINE:
            self.__init__()  # type: ignore[misc]
            raise ScriptError(f"a program of more than {self.LIMIT} characters, or a line of more than {self.LINE}")
        return done

    def _add(self, line: str) -> str | None:
        if not self._program:
            # Between programs, lines that say nothing run nothing: the program that runs goes on.
            line = line.removeprefix(_BYTE_ORDER_MARK)
            if not line.strip() or line.lstrip().startswith("#"):
                self._size = len(self._line)
                return None
        self._program.append(line)
        for match in _WORD.finditer(line):
            word = match.group(1)
            if word:
                self._depth += -1 if word == "end" else 1
        if self._depth > 0:
            return None
        program, self._program, self._depth, self._size = "\n".join(self._program) + "\n", [], 0, 0
        return program
