"""Mutants of a source: one comparison or one sign is another, all else as it was.

speed < SLOWEST_MPS   ->   speed <= SLOWEST_MPS,   speed >= SLOWEST_MPS
u + w                 ->   u - w
-delta                ->   +delta
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
SIGNS: dict[type[ast.operator], type[ast.operator]] = {ast.Add: ast.Sub, ast.Sub: ast.Add}


class Flip(NamedTuple):
    """One changed source. name: where and what, without line numbers; unique in its module."""

    name: str
    source: str


def flips(source: str) -> Iterator[Flip]:
    """Every mutant, in the order of the source. Comments and layout are lost, meaning is not."""
    tree = ast.parse(source)
    names: Counter[str] = Counter()
    for scope, node in _walk(tree, ""):
        before = ast.unparse(node)
        for field, changed in _edits(node):
            kept = getattr(node, field)
            setattr(node, field, changed)
            name = f"{scope or 'module'}: {before} -> {ast.unparse(node)}"
            names[name] += 1
            yield Flip(name if names[name] == 1 else f"{name} #{names[name]}", ast.unparse(tree))
            setattr(node, field, kept)


def _walk(node: ast.AST, scope: str) -> Iterator[tuple[str, ast.AST]]:
    """Every node below, with where it stands: Class.method."""
    for child in ast.iter_child_nodes(node):
        yield scope, child
        named = isinstance(child, ast.FunctionDef | ast.ClassDef)
        yield from _walk(child, f"{scope}.{child.name}".lstrip(".") if named else scope)


def _edits(node: ast.AST) -> Iterator[tuple[str, object]]:
    """A field of the node and what it becomes."""
    match node:
        case ast.Compare(ops=ops):
            for k, op in enumerate(ops):
                for other in COMPARISONS[type(op)]:
                    yield "ops", [*ops[:k], other(), *ops[k + 1 :]]
        case ast.BinOp(op=op) | ast.AugAssign(op=op) if type(op) in SIGNS:
            yield "op", SIGNS[type(op)]()
        case ast.UnaryOp(op=ast.USub()):
            yield "op", ast.UAdd()
