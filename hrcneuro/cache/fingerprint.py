"""Hashes that decide a key: of values, of files, of code without its comments, and of library versions."""

from __future__ import annotations

import ast
import contextlib
import functools
import hashlib
import importlib.metadata
import json
import os
import re
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from json.encoder import encode_basestring_ascii as _in_quotes
from pathlib import Path
from typing import Any

from hrcneuro.cache.disk import read_json

_SETTLED_NS = 2_000_000_000
# A line of 150 bytes for each recording, and 300 for each module of the program.
_LARGEST_MEMO = 2**26
_SHA256 = re.compile("[0-9a-f]{64}")
# Made once: json.dumps makes another one each time that it is asked for anything but its defaults.
_CANONICAL = json.JSONEncoder(sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=True)


def digest(value: Any) -> str:
    """Return the sha256 of a JSON-able value in canonical form (sorted keys, no blanks)."""
    return _sha256(canonical(value))


def digest_of(texts: Mapping[str, str]) -> str:
    """Return what :func:`digest` does, of a table whose values are in canonical form already."""
    if not texts:
        return _sha256("{}")
    first, *others = sorted(texts)
    # Of keys, the first part is the code of a stage: thousands of bytes, the same for all subjects.
    hashed = _begun(first, texts[first]).copy()
    hashed.update("".join([f",{_in_quotes(name)}:{texts[name]}" for name in others]).encode() + b"}")
    return hashed.hexdigest()


@functools.lru_cache(maxsize=128)
def _begun(name: str, text: str) -> hashlib._Hash:
    return hashlib.sha256(f"{{{_in_quotes(name)}:{text}".encode())


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def canonical(value: Any) -> str:
    """Return a JSON-able value in canonical form: sorted keys, no blanks."""
    return _in_quotes(value) if type(value) is str else _CANONICAL.encode(value)


def file_digest(path: Path) -> str:
    """Return the sha256 of a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


class Memo:
    """Remembers what was computed from a file while its path, size, mtime and inode stay the same."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.changed = False
        # Of modules that were looked at in this object's life, which many stages import: hash and imports, or None.
        self.modules: dict[tuple[str, Path], tuple[str, list[str]] | None] = {}
        try:
            known = read_json(path, max_bytes=_LARGEST_MEMO)
        except (OSError, ValueError):
            known = {}
        # Names that are no digests are of an older version, and tell the machine's folders.
        self.known: dict[str, Any] = {n: v for n, v in known.items() if ":" not in n} if isinstance(known, dict) else {}

    def get(
        self, kind: str, path: Path, compute: Callable[[Path], Any], *, valid: Callable[[Any], bool] | None = None
    ) -> Any:
        """Return ``compute(path)``, from memory where the file is unchanged.

        ``valid`` judges what is remembered, which anybody may have written who may write the cache; without it, only
        the hash of a file passes.
        """
        stat = path.stat()
        stamp = [stat.st_size, stat.st_mtime_ns, stat.st_ino]
        # A memo may lie beside a report that is passed on: it names no folder of this machine.
        name = hashlib.sha256(f"{kind}:{path.absolute()}".encode(errors="surrogateescape")).hexdigest()[:32]
        entry = self.known.get(name)
        if isinstance(entry, list) and len(entry) == 2 and entry[0] == stamp and (valid or is_sha256)(entry[1]):
            return entry[1]
        value = compute(path)
        # A file written a moment ago may change again within one tick of the file system's clock.
        if time.time_ns() - stat.st_mtime_ns > _SETTLED_NS:
            self.known[name] = [stamp, value]
            self.changed = True
        return value

    def save(self) -> None:
        """Write what is new; a memo that cannot be written only costs time."""
        if not self.changed:
            return
        part = self.path.with_name(f"{self.path.name}.{os.getpid()}")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            part.write_text(json.dumps(self.known))
            part.replace(self.path)
            self.changed = False
        except OSError:
            with contextlib.suppress(OSError):
                part.unlink()


def code(module: str, root: Path, memo: Memo) -> dict[str, str]:
    """Return module name -> hash, for a module and everything it imports from the same package.

    Comments, docstrings and formatting do not enter; imports inside functions count, those under
    ``if TYPE_CHECKING`` do not, except in a module with ``__getattr__``: what it names there it loads on first use.
    """
    # What was read by another reader (this file, or Python's grammar) is no memory of what this one would find.
    kind = f"code {file_digest(Path(__file__))[:8]} {sys.version_info[0]}.{sys.version_info[1]}"
    hashes: dict[str, str] = {}
    listed = functools.cache(_listed)
    todo = [module]
    while todo:
        name = todo.pop()
        if name in hashes:
            continue
        if (name, root) not in memo.modules:
            path = _module_path(name, root, listed)
            read = functools.partial(read_code, name=name, package=root.name)
            memo.modules[name, root] = None if path is None else memo.get(kind, path, read, valid=_is_code)
        if found := memo.modules[name, root]:
            hashes[name], imports = found
            todo += imports
    return dict(sorted(hashes.items()))


def read_code(path: Path, name: str, package: str) -> tuple[str, list[str]]:
    """Return a source file's hash and the names that it imports from the package (some may be no modules)."""
    tree = ast.parse(path.read_bytes())
    imports = _imports(tree, name if path.name == "__init__.py" else name.rpartition(".")[0])
    inside = sorted(i for i in imports if i == package or i.startswith(f"{package}."))
    _strip(tree)
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest(), [i for i in inside if i != package]


def libraries(names: Iterable[str]) -> dict[str, str]:
    """Return library -> major.minor, with Python itself; ``absent`` where it is not installed."""
    versions = {"python": ".".join(map(str, sys.version_info[:2]))}
    for name in names:
        versions[name] = ".".join(version(name).split(".")[:2])
    return versions


@functools.cache
def version(name: str) -> str:
    """Return an installed distribution's version, or ``absent``."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "absent"


def key(parts: Mapping[str, Any], texts: Mapping[str, str] | None = None) -> str:
    """Return the key of named parts: the first 16 hex digits of their sha256.

    ``texts`` are parts in canonical form, by name, where somebody has them: what many keys share is written once.
    """
    known = texts or {}
    return digest_of({name: known.get(name) or canonical(part) for name, part in parts.items()})[:16]


def is_sha256(value: Any) -> bool:
    """Return whether a value is a sha256 in hexadecimal digits."""
    return isinstance(value, str) and _SHA256.fullmatch(value) is not None


def _is_code(value: Any) -> bool:
    """Return whether a value is what :func:`read_code` returns, in JSON."""
    if not isinstance(value, list | tuple) or len(value) != 2 or not is_sha256(value[0]):
        return False
    return isinstance(value[1], list) and all(isinstance(name, str) for name in value[1])


def _module_path(name: str, root: Path, listed: Callable[[str], frozenset[str]]) -> Path | None:
    # By what is in its folder: of thousands of names most are no modules, and to look for each takes longer.
    *above, last = name.split(".")
    folder = os.path.join(root.parent, *above)
    path = f"{folder}/{last}.py"
    if f"{last}.py" in listed(folder) and os.path.isfile(path):
        return Path(path)
    path = f"{folder}/{last}/__init__.py"
    return Path(path) if last in listed(folder) and os.path.isfile(path) else None


def _listed(folder: str) -> frozenset[str]:
    try:
        return frozenset(os.listdir(folder))
    except OSError:
        return frozenset()


def _imports(tree: ast.Module, folder: str) -> set[str]:
    names: set[str] = set()
    lazy = any(isinstance(node, ast.FunctionDef) and node.name == "__getattr__" for node in tree.body)
    todo: list[ast.AST] = [tree]
    while todo:
        node = todo.pop()
        if isinstance(node, ast.If) and not lazy and "TYPE_CHECKING" in ast.dump(node.test):
            todo += node.orelse
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                up = folder.split(".")
                base = ".".join([*up[: len(up) - node.level + 1], *([base] if base else [])])
            # ``from package import name``: name may be a module, and the package's own file runs too.
            names |= {base, *(f"{base}.{alias.name}" for alias in node.names)}
        todo += ast.iter_child_nodes(node)
    return names | {".".join(n.split(".")[:i]) for n in names for i in range(2, n.count(".") + 1)}


def _strip(tree: ast.AST) -> None:
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                node.body = node.body[1:]
