"""URScript's expressions as Python text: the lower half of the translation, and the tokens it reads."""

from __future__ import annotations

from collections.abc import Collection
from math import inf, isinf

from hrcneuro.ur10.urscript.lexer import Token, tokens, wrong
from hrcneuro.ur10.urscript.signatures import Call, Signatures
from hrcneuro.ur10.urscript.values import whole

_CONSTANTS = {"True": "True", "False": "False", "pi": "3.141592653589793"}
_ARITHMETIC = {"+": "plus", "-": "minus", "*": "times", "/": "over", "%": "modulo"}
_COMPARISONS = frozenset(("==", "!=", "<", ">", "<=", ">="))


class Scope:
    """The names of one function."""

    def __init__(self, outer: Scope | None, parameters: Collection[str] = ()) -> None:
        self.outer = outer
        self.assigned = set(parameters)
        self.nonlocals: set[str] = set()

    def variable(self, name: str) -> bool:
        """Return whether this function, or one around it, has a variable of that name."""
        return name in self.assigned or (self.outer is not None and self.outer.variable(name))


class Expressions:
    """The tokens of one script, and the names it knows."""

    def __init__(
        self, script: str, *, plain: Collection[str], blocking: Collection[str], signatures: Signatures | None = None
    ) -> None:
        """Take a script, the names of built-in functions that return at once or take time, and what they are given."""
        self._tokens = tokens(script)
        self._at = 0
        self._plain, self._blocking, self._signatures = plain, blocking, signatures or Signatures({})
        self._calls: list[Call] = []  # of the script's own functions, which may stand further down
        self._scope = Scope(None)
        # Functions may be called above where they are defined.
        self._globals, self._functions = self._named("global"), self._named("def", "thread")

    def _named(self, *words: str) -> set[str]:
        pairs = zip(self._tokens, self._tokens[1:], strict=False)
        return {b.text for a, b in pairs if a.kind == "keyword" and a.text in words and b.kind == "name"}

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
            left = f"rt.boolean({left})"
            left = f"({left} or rt.boolean({right}))" if word == "or" else f"({left} != rt.boolean({right}))"
        return left

    def _conjunction(self) -> str:
        left = self._negation()
        while self._take("and"):
            left = f"(rt.boolean({left}) and rt.boolean({self._negation()}))"
        return left

    def _negation(self) -> str:
        if self._take("not") or self._take("!"):  # ! in the script manual's own example
            return f"(not rt.boolean({self._negation()}))"
        left = self._sum()
        while self._peek().kind == "sign" and self._peek().text in _COMPARISONS:
            sign = self._next().text
            right = self._sum()
            ordered = sign not in ("==", "!=")
            left = f"(rt.ordered({left}) {sign} rt.ordered({right}))" if ordered else f"({left} {sign} {right})"
        return left

    def _sum(self) -> str:
        left = self._product()
        while self._peek().kind == "sign" and self._peek().text in ("+", "-"):
            left = f"rt.{_ARITHMETIC[self._next().text]}({left}, {self._product()})"
        return left

    def _product(self) -> str:
        left = self._unary()
        while self._peek().kind == "sign" and self._peek().text in ("*", "/", "%"):
            left = f"rt.{_ARITHMETIC[self._next().text]}({left}, {self._unary()})"
        return left

    def _unary(self) -> str:
        if self._take("-"):
            return f"rt.negated({self._unary()})"
        if self._take("+"):
            return self._unary()
        value = self._atom()
        while self._take("["):
            for i in self._list("]"):
                value = f"rt.at({value}, {i})"
        return value

    def _atom(self) -> str:
        self._part_variable_p()
        token = self._next()
        if token.kind == "number":
            return repr(literal(token))
        if token.kind == "string":
            return repr(token.text[1:-1])
        if token.text == "(":
            value = self._expression()
            self._expect(")")
            return f"({value})"
        if token.text == "[":
            return "rt.items([" + ", ".join(self._list("]")) + "])"
        if token.text == "p[":
            return "rt.pose(" + ", ".join(self._list("]")) + ")"
        if token.text == "run":
            name = self._next()
            if name.text not in self._functions:
                raise wrong(name, f"no thread {name.text!r}", f"compile_error_name_not_found:{name.text}:")
            self._expect("(")
            return f"rt.run(f_{name.text}({self._given(name)}))"
        if token.text in _CONSTANTS and not self._scope.variable(token.text):
            return _CONSTANTS[token.text]
        if token.kind == "name":
            return self._call(token) if self._take("(") else self._called(self._read(token.text, token))
        raise wrong(token, f"unexpected {token.text.strip() or 'end of line'!r}")

    def _call(self, token: Token) -> str:
        name = token.text
        if name in self._functions:
            return f"(yield from f_{name}({self._given(token)}))"
        if name not in self._blocking and name not in self._plain:
            raise wrong(token, f"no function {name!r}", f"compile_error_name_not_found:{name}:")
        given = self._arguments()
        self._signatures.check(Call(token, [key for key, _ in given]))
        arguments = ", ".join(f"{key}={value}" if key else value for key, value in given)
        return f"(yield from b_{name}({arguments}))" if name in self._blocking else f"b_{name}({arguments})"

    def _called(self, value: str) -> str:
        # handle.function(…): a remote procedure, of what rpc_factory returned.
        while self._take("."):
            name = self._name()
            self._expect("(")
            given = ", ".join([value, repr(name), *self._list(")")])
            value = f"(yield from b__remote({given}))"
        return value

    def _given(self, function: Token) -> str:
        # What one of the script's own functions is called with.
        given = self._arguments()
        self._calls.append(Call(function, [key for key, _ in given]))
        return ", ".join(f"v_{key}={value}" if key else value for key, value in given)

    def _arguments(self) -> list[tuple[str, str]]:
        """Return what stands up to the closing bracket: the parameter's name, or none, and the value."""
        given = []
        while not self._take(")"):
            following = self._tokens[self._at + 1]
            name = ""
            if self._peek().kind == "name" and following.kind == "sign" and following.text == "=":
                name = self._name()
                self._expect("=")
            given.append((name, self._expression()))
            if not self._take(","):
                self._expect(")")
                break
        return given

    def _known(self, name: str) -> bool:
        return name in self._globals or self._scope.variable(name)

    def _read(self, name: str, token: Token) -> str:
        if name in self._scope.assigned:
            return f"v_{name}"
        if name in self._globals:
            return f"g_{name}"
        if self._scope.variable(name):
            return f"v_{name}"
        raise wrong(token, f"no variable {name!r}", f"compile_error_name_not_found:{name}:")

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
            raise wrong(token, f"expected {text!r}, got {token.text.strip() or 'end of line'!r}")

    def _name(self) -> str:
        token = self._next()
        if token.kind != "name":
            raise wrong(token, f"expected a name, got {token.text.strip() or 'end of line'!r}")
        return token.text

    def _part_variable_p(self) -> None:
        # p[0] is an element of p where there is a variable of that name, else the beginning of a pose.
        token = self._peek()
        if token.text == "p[" and token.kind == "sign" and (self._scope.variable("p") or "p" in self._globals):
            self._tokens[self._at : self._at + 1] = [Token("name", "p", token.line), Token("sign", "[", token.line)]

    def _skip_newlines(self) -> None:
        while self._peek().kind == "newline":
            self._at += 1


def literal(token: Token) -> float:
    """Return the number that a token writes; an integer of more than 32 bits is a float, as a sum would be.

    Raises:
        ScriptError: It is beyond the greatest number.
    """
    based = token.text[:2].lower() in ("0x", "0b")
    try:
        value = float(int(token.text, 0) if based else token.text)
    except OverflowError:
        value = inf
    if isinf(value):
        raise wrong(token, f"{token.text[:40]} is beyond the greatest number, 1.8e308")
    return whole(value) if based or token.text.isdigit() else value
