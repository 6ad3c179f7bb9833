"""Figures from a package's sources: imports, deep attribute chains, writes to foreign fields."""

import ast
from collections import Counter
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
DEEP = 3
"""Number of attributes in a chain from which a line depends on other objects' internals."""


def _files(room: str) -> Iterator[tuple[tuple[str, ...], ast.Module, int]]:
    """(name parts below the package, syntax tree, lines) of each file of a dotted package."""
    folder = ROOT.joinpath(*room.split("."))
    for path in sorted(folder.rglob("*.py")):
        text = path.read_text()
        yield path.relative_to(folder).with_suffix("").parts, ast.parse(text), text.count("\n")


class Graph(NamedTuple):
    """The packages directly inside a package, and who imports whom."""

    rooms: list[str]
    arrows: list[tuple[str, str]]

    @property
    def floors(self) -> int:
        """Length of the longest import chain, in packages; 0 if there is a cycle."""
        below: dict[str, set[str]] = {room: set() for room in self.rooms}
        for from_, to in self.arrows:
            below[from_].add(to)
        order, floors = TopologicalSorter(below), 0
        try:
            order.prepare()
        except CycleError:
            return 0
        while order.is_active():
            order.done(*order.get_ready())
            floors += 1
        return floors

    @property
    def upward(self) -> list[tuple[str, str]]:
        """Imports that are part of a cycle: with one of them, there is no order of layers."""
        return [(a, b) for a, b in self.arrows if self._leads(b, a)]

    def _leads(self, begin: str, end: str) -> bool:
        seen, ahead = set[str](), [begin]
        while ahead:
            room = ahead.pop()
            if room == end:
                return True
            if room not in seen:
                seen.add(room)
                ahead += [to for from_, to in self.arrows if from_ == room]
        return False


def graph(room: str) -> Graph:
    """The imports between the packages directly inside a package, without its own __init__."""
    rooms, arrows = set[str](), set[tuple[str, str]]()
    for parts, tree, _ in _files(room):
        if parts == ("__init__",):
            continue
        rooms.add(parts[0])
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(f"{room}."):
                arrows.add((parts[0], (node.module or "").removeprefix(f"{room}.").split(".")[0]))
    return Graph(sorted(rooms), sorted((a, b) for a, b in arrows if a != b))


def deep_chains(room: str) -> tuple[int, int]:
    """(chains of three and more attributes on a name, lines of code and text)."""
    found = lines = 0
    for _, tree, n in _files(room):
        lines += n
        inner = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        found += sum(
            isinstance(node, ast.Attribute) and id(node) not in inner and _hops(node) >= DEEP
            for node in ast.walk(tree)
        )
    return found, lines


def _hops(node: ast.Attribute) -> int:
    """Number of consecutive attributes on a name; 0 if there is a call in between."""
    hops, inside = 1, node.value
    while isinstance(inside, ast.Attribute):
        hops, inside = hops + 1, inside.value
    return hops if isinstance(inside, ast.Name) else 0


def writes(room: str, class_name: str) -> Counter[str]:
    """How often each file sets a field of that class, by the names of its slots."""
    slots = next(
        set(ast.literal_eval(statement.value))
        for _, tree, _ in _files(room)
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef) and node.name == class_name
        for statement in node.body
        if isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == "__slots__"
    )
    found = Counter[str]()
    for parts, tree, _ in _files(room):
        for node in ast.walk(tree):
            if (
                isinstance(node, ast.Attribute)
                and isinstance(node.ctx, ast.Store)
                and node.attr in slots
                and not (isinstance(node.value, ast.Name) and node.value.id == "self")
            ):
                found["/".join(parts) + ".py"] += 1
    return found
