"""Translates a URScript program into Python source, statement by statement: every function becomes a generator.

Calls that may take time (user functions, moves, sync) become ``yield from``; a bare ``yield`` ends a thread's cycle.
Names get a prefix, so that none can reach anything of Python's: g_ global, v_ local, f_ function, b_ built in.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager

from hrcneuro.ur10.urscript.lexer import ScriptError, Token, tokens

_CONSTANTS = {"True": "True", "False": "False", "pi": "3.141592653589793"}
_COMPARISONS = frozenset(("==", "!=", "<", ">", "<=", ">="))
_BLOCKS_END = frozenset(("end", "elif", "else"))


class _Scope:
    """The names of one function."""

    def __init__(self, outer: _Scope | None, parameters: Collection[str] = ()) -> None:
        self.outer = outer
        self.assigned = set(parameters)
        self.nonlocals: set[str] = set()
        self.globals: set[str] = set()

    def variable(self, name: str) -> bool:
        return name in self.assigned or (self.outer is not None and self.outer.variable(name))


class Translator:
    """One script; :meth:`source` is the Python text that defines ``program()``, a generator function."""

    def __init__(self, script: str, *, plain: Collection[str], blocking: Collection[str]) -> None:
        """Take a script, and the names of built-in functions that return at once or take time."""
        self._tokens = tokens(script)
        self._at = 0
        self._plain, self._blocking = plain, blocking
        self._lines: list[str] = []
        self._indent = 1
        self._loops = 0
        self._scope = _Scope(None)
        self.secondary = False
        self.name = ""
        # Functions may be called above where they are defined.
        self._globals, self._functions = self._named("global"), self._named("def", "thread")

    def source(self) -> str:
        """Return the Python source.

        Raises:
            ScriptError: The script is not URScript, or calls what does not exist.
        """
        self._skip_newlines()
        first = self._peek()
        if first.text in ("def", "sec") and first.kind == "keyword":
            self.secondary = first.text == "sec"
            self._next()
            self.name = self._name()
            for sign in "():":
                self._expect(sign)
            self._block()
            self._expect("end")
            self._skip_newlines()
        while self._peek().kind != "eof":
            self._statement()
        declared = ["    global " + ", ".join(f"g_{n}" for n in sorted(self._globals))] if self._globals else []
        return "\n".join(["def program():", "    if False: yield", *declared, *self._lines, ""])

    def _named(self, *words: str) -> set[str]:
        pairs = zip(self._tokens, self._tokens[1:], strict=False)
        return {b.text for a, b in pairs if a.kind == "keyword" and a.text in words and b.kind == "name"}

    # --- statements ---------------------------------------------------------------------------------------------

    def _block(self) -> None:
        self._skip_newlines()
        if self._peek().kind == "keyword" and self._peek().text in _BLOCKS_END:
            self._emit("pass")
        while not (self._peek().kind == "keyword" and self._peek().text in _BLOCKS_END):
            if self._peek().kind == "eof":
                raise ScriptError(f"line {self._peek().line}: 'end' is missing")
            self._statement()
        self._skip_newlines()

    def _statement(self) -> None:
        self._part_variable_p()
        token = self._peek()
        if token.kind == "keyword":
            handler = getattr(self, f"_on_{token.text}", None)
            if handler is not None:
                self._next()
                handler()
                self._end_statement()
                return
        elif token.kind == "name" and self._assignment():
            self._end_statement()
            return
        self._emit(self._expression())
        self._end_statement()

    def _assignment(self) -> bool:
        start = self._at
        name = self._name()
        if self._take("="):
            self._assign(name, self._copied())
            return True
        if self._take("["):
            indices = self._list("]")
            if self._take("="):
                target = self._read(name, self._tokens[start])
                place = "".join(f"[int({i})]" for i in indices)
                self._emit(f"{target}{place} = {self._expression()}")
                return True
        self._at = start
        return False

    def _assign(self, name: str, value: str) -> None:
        if name in self._globals and name not in self._scope.assigned:
            self._emit(f"g_{name} = {value}")
            return
        # A name of the program's body that a function changes is the body's.
        if name not in self._scope.assigned and self._scope.outer is not None and self._scope.outer.variable(name):
            self._scope.nonlocals.add(name)
        else:
            self._scope.assigned.add(name)
        self._emit(f"v_{name} = {value}")

    def _on_global(self) -> None:
        # The same statement may stand in a function: "global x = run y()".
        name = self._name()
        if self._take("="):
            self._emit(f"g_{name} = {self._copied()}")

    def _on_local(self) -> None:
        name = self._name()
        self._scope.assigned.add(name)
        if self._take("="):
            self._emit(f"v_{name} = {self._copied()}")

    def _on_def(self) -> None:
        self._define()

    def _on_thread(self) -> None:
        self._define()

    def _define(self) -> None:
        name = self._name()
        self._expect("(")
        parameters = []
        while not self._take(")"):
            parameters.append((self._name(), self._expression() if self._take("=") else ""))
            self._take(",")
        self._expect(":")
        outer, lines, loops = self._scope, self._lines, self._loops
        self._scope, self._lines, self._loops = _Scope(outer, [p for p, _ in parameters]), [], 0
        self._indent += 1
        self._block()
        self._indent -= 1
        inner, body, self._scope, self._lines, self._loops = self._scope, self._lines, outer, lines, loops
        self._expect("end")
        head = ", ".join(f"v_{p}={default}" if default else f"v_{p}" for p, default in parameters)
        self._emit(f"def f_{name}({head}):")
        with self._indented():
            self._emit("if False: yield")
            if self._globals:
                self._emit("global " + ", ".join(f"g_{n}" for n in sorted(self._globals)))
            if inner.nonlocals:
                self._emit("nonlocal " + ", ".join(f"v_{n}" for n in sorted(inner.nonlocals)))
            # Lists are values in URScript: a function changes a copy.
            for p, _ in parameters:
                self._emit(f"v_{p} = rt.copy(v_{p})")
        self._lines += body

    def _on_if(self) -> None:
        self._branch("if")
        while self._peek().kind == "keyword" and self._peek().text == "elif":
            self._next()
            self._branch("elif")
        if self._peek().kind == "keyword" and self._peek().text == "else":
            self._next()
            self._expect(":")
            self._emit("else:")
            with self._indented():
                self._block()
        self._expect("end")

    def _branch(self, word: str) -> None:
        self._emit(f"{word} {self._expression()}:")
        self._expect(":")
        with self._indented():
            self._block()

    def _on_while(self) -> None:
        self._emit(f"while {self._expression()}:")
        self._expect(":")
        self._loops += 1
        with self._indented():
            # A loop without sync must not stop the controller: when its share of the cycle is used up it waits.
            self._emit("rt.budget -= 1")
            self._emit("if rt.budget < 0: yield")
            self._block()
        self._loops -= 1
        self._expect("end")

    def _on_return(self) -> None:
        empty = self._peek().kind == "newline" or self._peek().text in _BLOCKS_END
        self._emit("return" if empty else f"return {self._expression()}")

    def _on_break(self) -> None:
        self._jump("break")

    def _on_continue(self) -> None:
        self._jump("continue")

    def _jump(self, word: str) -> None:
        if not self._loops:
            raise ScriptError(f"line {self._peek().line}: '{word}' outside of a loop")
        self._emit(word)

    def _on_pass(self) -> None:
        self._emit("pass")

    def _on_halt(self) -> None:
        self._emit("yield from rt.halt()")

    def _on_kill(self) -> None:
        self._emit(f"if rt.kill({self._expression()}): yield")

    def _on_join(self) -> None:
        self._emit(f"yield from rt.join({self._expression()})")

    def _on_enter_critical(self) -> None:
        self._emit("rt.enter_critical()")

    def _on_exit_critical(self) -> None:
        self._emit("rt.exit_critical()")

    # --- expressions, loosest first -----------------------------------------------------------------------------

    def _copied(self) -> str:
        start = self._at
        value = self._expression()
        # Literals and calls are new already; a bare name or element may be a list that lives on.
        return f"rt.copy({value})" if self._tokens[start].kind == "name" else value

    def _expression(self) -> str:
        left = self._conjunction()
        while self._peek().kind == "keyword" and self._peek().text in ("or", "xor"):
            word = self._next().text
            right = self._conjunction()
            left = f"({left} or {right})" if word == "or" else f"(bool({left}) != bool({right}))"
        return left

    def _conjunction(self) -> str:
        left = self._negation()
        while self._take("and"):
            left = f"({left} and {self._negation()})"
        return left

    def _negation(self) -> str:
        if self._take("not"):
            return f"(not {self._negation()})"
        left = self._sum()
        while self._peek().kind == "sign" and self._peek().text in _COMPARISONS:
            sign = self._next().text
            left = f"({left} {sign} {self._sum()})"
        return left

    def _sum(self) -> str:
        left = self._product()
        while self._peek().kind == "sign" and self._peek().text in ("+", "-"):
            sign = self._next().text
            left = f"({left} {sign} {self._product()})"
        return left

    def _product(self) -> str:
        left = self._unary()
        while self._peek().kind == "sign" and self._peek().text in ("*", "/", "%"):
            sign = self._next().text
            left = f"({left} {sign} {self._unary()})"
        return left

    def _unary(self) -> str:
        if self._take("-"):
            return f"(-{self._unary()})"
        if self._take("+"):
            return self._unary()
        value = self._atom()
        while self._take("["):
            value += "".join(f"[int({i})]" for i in self._list("]"))
        return value

    def _atom(self) -> str:
        self._part_variable_p()
        token = self._next()
        if token.kind == "number":
            # Leading zeros are no number in Python.
            return repr(float(token.text)) if not _whole(token.text) else str(_integer(token.text))
        if token.kind == "string":
            return repr(token.text[1:-1])
        if token.text == "(":
            value = self._expression()
            self._expect(")")
            return f"({value})"
        if token.text == "[":
            return "[" + ", ".join(self._list("]")) + "]"
        if token.text == "p[":
            return "rt.pose(" + ", ".join(self._list("]")) + ")"
        if token.text == "run":
            name = self._next()
            if name.text not in self._functions:
                raise ScriptError(f"line {name.line}: no thread {name.text!r}")
            self._expect("(")
            return f"rt.run(f_{name.text}({self._arguments('v_')}))"
        if token.text in _CONSTANTS and not self._scope.variable(token.text):
            return _CONSTANTS[token.text]
        if token.kind == "name":
            return self._call(token) if self._take("(") else self._read(token.text, token)
        raise ScriptError(f"line {token.line}: unexpected {token.text.strip() or 'end of line'!r}")

    def _call(self, token: Token) -> str:
        name = token.text
        if name in self._functions:
            return f"(yield from f_{name}({self._arguments('v_')}))"
        arguments = self._arguments()
        if name in self._blocking:
            return f"(yield from b_{name}({arguments}))"
        if name in self._plain:
            return f"b_{name}({arguments})"
        raise ScriptError(f"line {token.line}: no function {name!r}")

    def _arguments(self, prefix: str = "") -> str:
        given = []
        while not self._take(")"):
            following = self._tokens[self._at + 1]
            if self._peek().kind == "name" and following.kind == "sign" and following.text == "=":
                name = self._name()
                self._expect("=")
                given.append(f"{prefix}{name}={self._expression()}")
            else:
                given.append(self._expression())
            if not self._take(","):
                self._expect(")")
                break
        return ", ".join(given)

    def _read(self, name: str, token: Token) -> str:
        if name in self._scope.assigned:
            return f"v_{name}"
        if name in self._globals:
            return f"g_{name}"
        if self._scope.variable(name):
            return f"v_{name}"
        raise ScriptError(f"line {token.line}: no variable {name!r}")

    def _list(self, closing: str) -> list[str]:
        values = []
        while not self._take(closing):
            values.append(self._expression())
            if not self._take(","):
                self._expect(closing)
                break
        return values

    # --- tokens -------------------------------------------------------------------------------------------------

    def _peek(self) -> Token:
        return self._tokens[self._at]

    def _next(self) -> Token:
        token = self._tokens[self._at]
        if token.kind != "eof":
            self._at += 1
        return token

    def _take(self, text: str) -> bool:
        token = self._tokens[self._at]
        if token.text == text and token.kind in ("sign", "keyword"):
            self._at += 1
            return True
        return False

    def _expect(self, text: str) -> None:
        if not self._take(text):
            token = self._peek()
            raise ScriptError(f"line {token.line}: expected {text!r}, got {token.text.strip() or 'end of line'!r}")

    def _name(self) -> str:
        token = self._next()
        if token.kind != "name":
            raise ScriptError(f"line {token.line}: expected a name, got {token.text.strip() or 'end of line'!r}")
        return token.text

    def _part_variable_p(self) -> None:
        # p[0] is an element of p where there is a variable of that name, else the beginning of a pose.
        token = self._peek()
        if token.text == "p[" and token.kind == "sign" and (self._scope.variable("p") or "p" in self._globals):
            self._tokens[self._at : self._at + 1] = [Token("name", "p", token.line), Token("sign", "[", token.line)]

    def _skip_newlines(self) -> None:
        while self._peek().kind == "newline":
            self._at += 1

    def _end_statement(self) -> None:
        token = self._peek()
        if token.kind == "newline":
            self._skip_newlines()
        elif token.kind not in ("eof", "keyword", "name"):
            # The next statement may begin on the same line, as it does in what ur_rtde uploads.
            raise ScriptError(f"line {token.line}: unexpected {token.text!r} after the statement")

    def _emit(self, line: str) -> None:
        self._lines.append("    " * self._indent + line)

    @contextmanager
    def _indented(self) -> Iterator[None]:
        self._indent += 1
        yield
        self._indent -= 1


def _whole(text: str) -> bool:
    return text.isdigit() or text[:2].lower() in ("0x", "0b")


def _integer(text: str) -> int:
    return int(text) if text.isdigit() else int(text, 0)
