# SPDX-License-Identifier: BSD-3-Clause
"""The texts that errors of the package are made of, found in its source.

A text is one of an error if it is in a statement that raises, in the making of an error, or in what these are made of
within their module: a local, a constant, what a function returns.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import click

import allanite
from allanite import errors
from allanite.commands.rules import Conflict, Requirement

__all__ = ["raised_texts"]

PACKAGE = Path(allanite.__file__).parent
_ERRORS = {*errors.__all__, click.UsageError.__name__, click.BadParameter.__name__}
_ERRORS |= {Conflict.__name__, Requirement.__name__}


@cache
def raised_texts(advice: re.Pattern[str]) -> tuple[tuple[str, str], ...]:
    """Place and text of each that holds an advice, with {} for what is put in."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        if advice.search(source):
            texts = ((node.lineno, _text(node)) for node in _Module(ast.parse(source)).texts())
            found += [(f"{path.relative_to(PACKAGE)}:{k}", text) for k, text in texts if advice.search(text)]
    return tuple(found)


def _text(node: ast.JoinedStr | ast.Constant) -> str:
    if isinstance(node, ast.Constant):
        return str(node.value)
    return "".join(str(v.value) if isinstance(v, ast.Constant) else "{}" for v in node.values)


class _Module:
    """Follows the names in errors to what they stand for, within one module."""

    def __init__(self, tree: ast.Module) -> None:
        self.tree = tree
        self.functions = {n.name: n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)}
        self.constants = dict(_assigned(tree.body))
        self.locals: dict[ast.FunctionDef, list[tuple[str, ast.AST]]] = {}
        self.seen: set[ast.AST] = set()

    def texts(self) -> list[ast.JoinedStr | ast.Constant]:
        self._look(self.tree, None)
        inside = {v for n in self.seen if isinstance(n, ast.JoinedStr) for v in n.values}
        found = [
            n
            for n in self.seen - inside
            if isinstance(n, ast.JoinedStr) or (isinstance(n, ast.Constant) and isinstance(n.value, str))
        ]
        return sorted(found, key=lambda n: (n.lineno, n.col_offset))

    def _look(self, node: ast.AST, scope: ast.FunctionDef | None) -> None:
        for child in ast.iter_child_nodes(node):
            if (isinstance(child, ast.Raise) and child.exc is not None) or _is_error(child):
                self._follow(child, scope)
            self._look(child, child if isinstance(child, ast.FunctionDef) else scope)

    def _follow(self, expression: ast.AST, scope: ast.FunctionDef | None) -> None:
        if expression in self.seen:
            return
        for node in ast.walk(expression):
            self.seen.add(node)
            if isinstance(node, ast.Name):
                for value in self._values(node.id, scope):
                    self._follow(value, scope)
            name = node.id if isinstance(node, ast.Name) else getattr(node, "attr", "")
            function = self.functions.pop(name, None)
            if function is not None:
                for part in ast.walk(function):
                    if isinstance(part, ast.Return) and part.value is not None:
                        self._follow(part.value, function)

    def _values(self, name: str, scope: ast.FunctionDef | None) -> Iterator[ast.AST]:
        if name in self.constants:
            yield self.constants[name]
        if scope is not None:
            if scope not in self.locals:
                self.locals[scope] = list(_assigned(ast.walk(scope)))
            yield from (value for target, value in self.locals[scope] if target == name)


def _is_error(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Call)
        and (getattr(node.func, "attr", None) or getattr(node.func, "id", "")) in _ERRORS
    )


def _assigned(nodes: object) -> Iterator[tuple[str, ast.AST]]:
    """Names, and what is assigned to them."""
    for node in nodes:  # type: ignore[attr-defined]
        if isinstance(node, (ast.Assign, ast.AnnAssign, ast.AugAssign)) and node.value is not None:
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for target in targets:
                yield from ((n.id, node.value) for n in ast.walk(target) if isinstance(n, ast.Name))
