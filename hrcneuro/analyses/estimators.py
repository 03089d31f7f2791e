"""Estimators of other people: the one door for code that is not of this program.

A recipe names an estimator by its import path, ``sklearn.svm.SVC``: of an installed package, whose version enters the
key, or of a Python file of the user's own (``file``), whose content enters it, with all that it imports beside it.
"""

from __future__ import annotations

import ast
import importlib
import importlib.metadata
import inspect
import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from hrcneuro.decoding.recipes import Recipe
from hrcneuro.decoding.refusals import EstimatorError
from hrcneuro.errors import did_you_mean

_STATE = "random_state"


def files(file: Path) -> dict[str, Path]:
    """Return name -> path of a Python file and of all that it imports from its own folder, whether it is there or not.

    A file that is no Python is returned alone: loading it says what is wrong.
    """
    folder, found, todo = file.parent, {}, [file]
    while todo:
        path = todo.pop()
        name = path.relative_to(folder).as_posix()
        if name not in found:
            found[name] = path
            todo += [other for module in _imported(path, folder) for other in _files_of(module, folder)]
    return dict(sorted(found.items()))


def _imported(path: Path, folder: Path) -> Iterator[str]:
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return
    inside = ".".join(path.relative_to(folder).parent.parts)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            up = inside.split(".")[: len(inside.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*(one for one in up if one), *([node.module] if node.module else [])])
            yield base
            yield from (f"{base}.{alias.name}".lstrip(".") for alias in node.names)


def _files_of(module: str, folder: Path) -> Iterator[Path]:
    parts = module.split(".")
    for end in range(1, len(parts) + 1):
        base = folder.joinpath(*parts[:end])
        yield from (one for one in (base.with_suffix(".py"), base / "__init__.py") if parts[0] and one.is_file())


def distribution(path: str) -> str:
    """Return the installed distribution that an import path belongs to.

    Raises:
        EstimatorError: There is none, or it is installed from a folder whose files may change under one version.
    """
    top = path.partition(".")[0]
    owners = importlib.metadata.packages_distributions().get(top, [])
    if not owners:
        raise EstimatorError(
            f"estimator = {path!r}: no installed package has {top!r}; name your own Python file with file = 'FILE.py'"
        )
    owner = sorted(owners)[0]
    origin = json.loads(importlib.metadata.distribution(owner).read_text("direct_url.json") or "{}")
    if origin.get("dir_info", {}).get("editable"):
        raise EstimatorError(
            f"estimator = {path!r}: {owner} is installed as editable, so that its version does not tell its content; "
            "install it without -e, or name its Python file with file = 'FILE.py'"
        )
    return owner


def maker(recipe: Recipe, *, seed: int) -> Callable[[], Any]:
    """Return a function that makes a recipe's estimator, a new one each time; whatever draws at random has ``seed``.

    Raises:
        EstimatorError: It cannot be imported or made, has no such parameter, or gives no scores.
    """
    make = _attribute(recipe)
    known = _parameters(make)
    for name in recipe.params:
        if known is not None and name not in known:
            hint = did_you_mean(name, known) or f"; allowed: {', '.join(sorted(known)) or 'none'}"
            raise EstimatorError(f"{recipe.estimator} has no parameter {name!r}{hint}")

    def made() -> Any:
        try:
            estimator = make(**recipe.params)
            drawn = {
                name: seed
                for name, value in estimator.get_params().items()
                if value is None and (name == _STATE or name.endswith(f"__{_STATE}"))
            }
            if drawn:
                estimator.set_params(**drawn)
            _validate(estimator)
            return estimator
        except Exception as error:  # foreign code raises whatever it likes
            raise EstimatorError(
                f"{recipe.estimator} cannot be made with {dict(recipe.params)}: {type(error).__name__}: {error}"
            ) from error

    first = made()
    if not all(hasattr(first, name) for name in ("fit", "get_params")) or not _scores(first):
        raise EstimatorError(
            f"{recipe.estimator} is no classifier of scikit-learn's kind: it needs fit, get_params, and "
            "decision_function or predict_proba"
        )
    return made


def _validate(estimator: Any) -> None:
    """Let an estimator of scikit-learn, and those inside it, look at their parameters, as they do before they fit."""
    for one in (estimator, *estimator.get_params().values()):
        validate = getattr(one, "_validate_params", None)
        if callable(validate) and not isinstance(one, type):
            validate()


def _scores(estimator: Any) -> bool:
    return hasattr(estimator, "decision_function") or hasattr(estimator, "predict_proba")


def _parameters(make: Any) -> set[str] | None:
    """Return the parameters that may be given; None where any may."""
    found = inspect.signature(make).parameters.values()
    if any(one.kind is inspect.Parameter.VAR_KEYWORD for one in found):
        return None
    return {one.name for one in found}


def _attribute(recipe: Recipe) -> Any:
    module_name, _, name = recipe.estimator.rpartition(".")
    try:
        module = _own(Path(recipe.file)) if recipe.file else importlib.import_module(module_name)
    except Exception as error:  # whatever foreign code raises while it is imported
        where = recipe.file or module_name
        raise EstimatorError(f"{where} cannot be imported: {type(error).__name__}: {error}") from error
    known = [one for one in dir(module) if callable(getattr(module, one)) and not one.startswith("_")]
    found = getattr(module, name, None)
    if not callable(found):
        hint = did_you_mean(name, known) or f"; it has {', '.join(known[:8]) or 'none'}"
        raise EstimatorError(f"{recipe.file or module_name} has no class or function {name!r}{hint}")
    return found


def _own(file: Path) -> ModuleType:
    """Return a file as a module, read anew: it may have changed since this process saw it last."""
    mine = {str(path) for path in files(file).values()}
    for name in [name for name, one in sys.modules.items() if getattr(one, "__file__", None) in mine]:
        del sys.modules[name]
    module = ModuleType(file.stem)
    module.__file__ = str(file)
    with _importing_from(file.parent):
        sys.modules[file.stem] = module
        exec(compile(file.read_bytes(), str(file), "exec"), module.__dict__)
    return module


@contextmanager
def _importing_from(folder: Path) -> Iterator[None]:
    """Let imports find the folder first, and leave no compiled file in it."""
    writes, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        sys.dont_write_bytecode = writes


def makers(recipes: Mapping[str, Recipe], *, seed: int) -> dict[str, Callable[[], Any]]:
    """Return name -> :func:`maker` of recipes whose estimators are named by their import paths."""
    return {name: maker(recipe, seed=seed) for name, recipe in recipes.items()}
