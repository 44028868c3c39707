"""The source of a class, with all that it needs, as a file that an interpreter elsewhere can run.

A class of an imported module is written with its whole module. One of a notebook or of the script that runs is written
alone, with those names of the notebook that it uses: running the rest again would run the campaign again.
"""
from __future__ import annotations

import ast
import base64
import inspect
import io
import linecache
import os
import pathlib
import pickle
import re
import symtable
import sys
import textwrap
import types
from typing import Dict, List, Set

from .errors import GrazeError


def source_of(made: type) -> str:
    """The text of a file that defines this class. Raises GrazeError if it cannot be had."""
    if "<locals>" in made.__qualname__ or "." in made.__qualname__:
        raise GrazeError(2, f"class {made.__qualname__} is defined within something else; a controller's class must stand at "
                            "the outermost level of its module or cell")
    module = sys.modules.get(made.__module__)
    if made.__module__ == "__main__" or module is None:
        return _Extract(made).text()
    return _module_text(made, module)


def pickled(value: object, what: str, own_module: str) -> str:
    """An expression whose value is a copy of `value`. Raises GrazeError for what another interpreter could not read."""
    try:
        data = pickle.dumps(value, protocol=4)
        _Checked(io.BytesIO(data), own_module).load()
    except Exception as error:  # whatever the object's own methods raise
        raise GrazeError(2, f"{what} is of type {type(value).__qualname__} and cannot be written beside the campaign: "
                            f"{error}") from error
    return f"__import__('pickle').loads(__import__('base64').b64decode({base64.b64encode(data).decode()!r}))"


class _Checked(pickle.Unpickler):
    """Refuses objects whose class only this process has."""

    def __init__(self, file: io.BytesIO, own_module: str):
        super().__init__(file)
        self._own = {"__main__", own_module}

    def find_class(self, module: str, name: str) -> object:
        if module in self._own:
            raise pickle.UnpicklingError(f"it holds an object of class {name}, which is defined beside the controller")
        return super().find_class(module, name)


def _module_text(made: type, module: types.ModuleType) -> str:
    """The module's file with a line that tells it where it stood, for what it imports and reads beside itself."""
    file = getattr(module, "__file__", None)
    if not file or not file.endswith(".py") or not os.path.isfile(file):
        raise GrazeError(2, f"class {made.__qualname__}: the source of module {module.__name__} cannot be had"
                            f"{f' ({file})' if file else ''}; a controller must stand in a .py file or in a cell of a notebook")
    place = pathlib.Path(file).resolve()
    text = place.read_text(encoding="utf-8")
    package = module.__package__ or ""
    root = place.parents[package.count(".") + 1] if package else place.parent
    note = f"import sys; sys.path.append({str(root)!r}); __file__ = {str(place)!r}"
    if package:
        note += f"; __package__ = {package!r}"
    lines = text.splitlines(keepends=True)
    after = _end_of_heading(ast.parse(text))
    if after and not lines[after - 1].endswith("\n"):
        lines[after - 1] += "\n"
    return "".join(lines[:after]) + note + "  # written by graze.run()\n" + "".join(lines[after:])


def _end_of_heading(tree: ast.Module) -> int:
    """The last line of what must come first in a file: its docstring and imports from __future__."""
    out = 0
    for number, node in enumerate(tree.body):
        text = number == 0 and isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if not text and not (isinstance(node, ast.ImportFrom) and node.module == "__future__"):
            break
        out = node.end_lineno or node.lineno
    return out


class _Extract:
    """Collects a class of the running script or notebook with the names that it uses."""

    def __init__(self, made: type):
        self._made = made
        self._space = vars(sys.modules[made.__module__])
        self._pieces: Dict[str, str] = {}  # in the order in which they must be run
        self._future: Set[str] = set()
        self._under_way: Set[str] = set()
        self._add_definition(made.__name__, made)

    def text(self) -> str:
        root = getattr(sys.modules["__main__"], "__file__", None)
        folder = str(pathlib.Path(root).resolve().parent) if root else os.getcwd()
        future = f"from __future__ import {', '.join(sorted(self._future))}\n" if self._future else ""
        return (f"{future}import sys; sys.path.append({folder!r})  # written by graze.run()\n\n"
                + "\n\n".join(self._pieces.values()) + "\n")

    def _add(self, name: str, user: str) -> None:
        if name in self._pieces or name in self._under_way or name not in self._space:
            return  # known, recursive, or a builtin
        value = self._space[name]
        here = getattr(value, "__module__", None) == self._made.__module__
        if isinstance(value, types.ModuleType):
            self._pieces[name] = f"import {value.__name__} as {name}" if "." not in value.__name__ else (
                f"{name} = __import__('importlib').import_module({value.__name__!r})")
        elif isinstance(value, (type, types.FunctionType)) and here:
            self._add_definition(name, value)
        elif isinstance(value, (type, types.FunctionType)):
            self._pieces[name] = f"from {value.__module__} import {value.__qualname__} as {name}"
        else:
            self._pieces[name] = f"{name} = {_expression(value, f'{name}, which {user} uses,', self._made.__module__)}"

    def _add_definition(self, name: str, value: object) -> None:
        self._under_way.add(name)
        text = self._definition(value)
        for used in _names_used(text):
            self._add(used, getattr(value, "__qualname__", name))
        alias = f"\n{name} = {value.__name__}" if value.__name__ != name else ""
        self._pieces[name] = text + alias
        self._under_way.discard(name)

    def _definition(self, value: object) -> str:
        """The text of a class or function, as its cell had it when it was defined."""
        what = f"{'class' if isinstance(value, type) else 'function'} {value.__qualname__}"
        for code in _codes(value):
            try:
                lines = linecache.getlines(code.co_filename, self._space)
                tree = ast.parse("".join(lines))
            except (OSError, SyntaxError):
                continue
            for node in ast.walk(tree):
                if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and node.name == value.__name__:
                    first = min([node.lineno] + [one.lineno for one in node.decorator_list])
                    if first <= code.co_firstlineno <= (node.end_lineno or first):
                        self._future |= _future_names(tree)
                        return textwrap.dedent("".join(lines[first - 1:node.end_lineno])).rstrip()
        raise GrazeError(2, f"the source of {what} cannot be had; define it with its own methods in a cell of a notebook, in a "
                            "script, or in a .py file that you import")


def _codes(value: object) -> List[types.CodeType]:
    """Of a function, or of the methods that a class has itself."""
    found = vars(value).values() if isinstance(value, type) else [value]
    plain = [one.__func__ if isinstance(one, (staticmethod, classmethod)) else one for one in found]
    return [inspect.unwrap(one).__code__ for one in plain if isinstance(one, types.FunctionType)]


def _future_names(tree: ast.Module) -> Set[str]:
    return {one.name for node in tree.body if isinstance(node, ast.ImportFrom) and node.module == "__future__"
            for one in node.names}


def _names_used(text: str) -> List[str]:
    """Names that a definition takes from its module, in a fixed order."""
    out: Set[str] = set()

    def look(table: symtable.SymbolTable) -> None:
        top = table.get_type() == "module"
        for symbol in table.get_symbols():
            if symbol.is_referenced() and (symbol.is_global() or (top and not symbol.is_assigned())):
                out.add(symbol.get_name())
        for child in table.get_children():
            look(child)

    look(symtable.symtable(text, "cell", "exec"))
    return sorted(out)


def _expression(value: object, what: str, own_module: str) -> str:
    """A literal where that says all, else a pickle."""
    try:
        if not re.search(r"\b(nan|inf)\b", repr(value)) and ast.literal_eval(repr(value)) == value:
            return repr(value)
    except Exception:  # its type writes something else
        pass
    return pickled(value, what, own_module)
