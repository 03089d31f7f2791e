"""Translates a URScript program into Python source, statement by statement: every function becomes a generator.

Calls that may take time (user functions, moves, sync) become ``yield from``; a bare ``yield`` ends a thread's cycle.
Names get a prefix, so that none can reach anything of Python's: g_ global, v_ local, f_ function, b_ built in.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager

from hrcneuro.ur10.urscript.expressions import Expressions, Scope, literal
from hrcneuro.ur10.urscript.lexer import wrong
from hrcneuro.ur10.urscript.signatures import Signatures

_BLOCKS_END = frozenset(("end", "elif", "else"))
_STRETCH = 100  # statements
# Assignments of URScript before its functions for outputs; controllers still take them, and urx sends them.
_OLD_OUTPUTS = {"digital_out": "set_digital_out", "analog_out": "set_analog_out"}


class Translator(Expressions):
    """One script; :meth:`source` is the Python text that defines ``program()``, a generator function."""

    def __init__(
        self, script: str, *, plain: Collection[str], blocking: Collection[str], signatures: Signatures | None = None
    ) -> None:
        """Take a script, the names of built-in functions that return at once or take time, and what they are given."""
        super().__init__(script, plain=plain, blocking=blocking, signatures=signatures)
        self._lines: list[tuple[str, int]] = []  # Python's, and the script's line that each comes from
        self._own = Signatures({})
        self._indent = 1
        self._loops = self._statements = 0
        self.secondary = False
        self.name = ""
        self.origin: list[int] = []  # after source(): of each line of Python, the script's line; 0 where there is none

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
        for call in self._calls:
            self._own.check(call)
        declared = ["    global " + ", ".join(f"g_{n}" for n in sorted(self._globals))] if self._globals else []
        head = ["def program():", "    if False: yield", *declared]
        self.origin = [0] * len(head) + [line for _, line in self._lines]
        return "\n".join([*head, *(text for text, _ in self._lines), ""])

    def _block(self) -> None:
        self._skip_newlines()
        if self._peek().kind == "keyword" and self._peek().text in _BLOCKS_END:
            self._emit("pass")
        while not (self._peek().kind == "keyword" and self._peek().text in _BLOCKS_END):
            if self._peek().kind == "eof":
                raise wrong(self._peek(), "'end' is missing")
            self._statement()
        self._skip_newlines()

    def _take_turn(self, cost: int) -> None:
        # Whatever goes on for ever must not stop the controller: a loop without sync, calls of calls, a script without
        # end. When its share of the cycle is used up it waits.
        self._emit(f"rt.budget -= {cost}")
        self._emit("if rt.budget < 0: yield rt.overrun()")

    @contextmanager
    def _counted_anew(self) -> Iterator[None]:
        # A body whose head takes a turn: what stands before it does not make its statements dear.
        before, self._statements = self._statements, 0
        yield
        self._statements = before

    def _statement(self) -> None:
        self._statements += 1
        if self._statements % _STRETCH == 0:
            self._take_turn(_STRETCH)
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
        elif token.text == "$" and token.kind == "sign":
            self._label()
            return
        self._emit(self._expression())
        self._end_statement()

    def _label(self) -> None:
        # $ 2 "MoveJ": what PolyScope shows of the program; sometimes with words behind the text.
        self._next()
        number, text = self._next(), self._next()
        place = literal(number) if number.kind == "number" else None
        if not isinstance(place, int) or text.kind != "string":
            raise wrong(number, 'a label is an integer of 32 bits and a text: $ 2 "MoveJ"')
        while self._peek().kind not in ("newline", "eof"):
            self._next()
        self._emit(f"b__label({place}, {text.text[1:-1]!r})")
        self._skip_newlines()

    def _assignment(self) -> bool:
        start = self._at
        name = self._name()
        if self._take("="):
            self._assign(name, self._copied())
            return True
        if self._take("["):
            indices = self._list("]")
            if self._take("="):
                setter = _OLD_OUTPUTS.get(name)
                if setter and len(indices) == 1 and not self._known(name):
                    self._emit(f"b_{setter}({indices[0]}, {self._expression()})")
                    return True
                target = self._read(name, self._tokens[start])
                self._emit(f"rt.put({target}, [{', '.join(indices)}], {self._expression()})")
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
        self._own.define(name, [(p, bool(default)) for p, default in parameters])
        self._expect(":")
        outer, lines, loops = self._scope, self._lines, self._loops
        self._scope, self._lines, self._loops = Scope(outer, [p for p, _ in parameters]), [], 0
        self._indent += 1
        with self._counted_anew():
            self._block()
        self._indent -= 1
        inner, body, self._scope, self._lines, self._loops = self._scope, self._lines, outer, lines, loops
        self._expect("end")
        head = ", ".join(f"v_{p}={default}" if default else f"v_{p}" for p, default in parameters)
        self._emit(f"def f_{name}({head}):")
        with self._indented():
            if self._globals:
                self._emit("global " + ", ".join(f"g_{n}" for n in sorted(self._globals)))
            if inner.nonlocals:
                self._emit("nonlocal " + ", ".join(f"v_{n}" for n in sorted(inner.nonlocals)))
            self._take_turn(1)
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
        self._emit(f"{word} rt.condition({self._expression()}):")
        self._expect(":")
        with self._indented():
            self._block()

    def _on_while(self) -> None:
        self._emit(f"while rt.condition({self._expression()}):")
        self._expect(":")
        self._loops += 1
        with self._indented(), self._counted_anew():
            self._take_turn(1)
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
            raise wrong(self._peek(), f"'{word}' outside of a loop")
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
        self._emit("if rt.exit_critical(): yield True")

    def _end_statement(self) -> None:
        token = self._peek()
        if token.kind == "newline":
            self._skip_newlines()
        elif token.kind not in ("eof", "keyword", "name"):
            # The next statement may begin on the same line, as it does in what ur_rtde uploads.
            raise wrong(token, f"unexpected {token.text!r} after the statement")

    def _emit(self, line: str) -> None:
        # What is emitted belongs to the token before: the newline behind a statement is not read yet.
        self._lines.append(("    " * self._indent + line, self._tokens[max(0, self._at - 1)].line))

    @contextmanager
    def _indented(self) -> Iterator[None]:
        self._indent += 1
        yield
        self._indent -= 1
