"""The changes: what may be changed in the functions of a file, one at a time."""

import ast
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

OTHER: dict[type, type] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
    ast.And: ast.Or, ast.Or: ast.And, ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Add,
    ast.Div: ast.Mult, ast.FloorDiv: ast.Mult, ast.Mod: ast.Add, ast.LShift: ast.RShift,
    ast.RShift: ast.LShift, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.BitXor: ast.BitAnd,
    ast.Break: ast.Continue, ast.Continue: ast.Break,
}  # fmt: skip
"""Operators and statements, and what each becomes."""
EXTREMES = {"min": "max", "max": "min"}
LARGE = 1000
"""From here on, a number is doubled: one more would change nothing that matters."""
SIGNS = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
    ast.Is: "is", ast.IsNot: "is not", ast.In: "in", ast.NotIn: "not in", ast.And: "and",
    ast.Or: "or", ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//",
    ast.Mod: "%", ast.LShift: "<<", ast.RShift: ">>", ast.BitAnd: "&", ast.BitOr: "|",
    ast.BitXor: "^", ast.Break: "break", ast.Continue: "continue",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Change:
    """One change of one file; `what` and the function name it, whatever lines come and go."""

    file: str
    line: int
    function: str
    what: str
    index: int
    lines: range
    """Those of the statement that is changed; of a compound one, those of its head."""

    @property
    def key(self) -> tuple[str, str, str]:
        """What names this change for as long as its function does not change there."""
        return self.file, self.function, self.what

    def __str__(self) -> str:
        return f"{self.file}:{self.line} {self.function}: {self.what}"


def changes(file: str, source: str) -> list[Change]:
    """All changes of a file."""
    found, seen = [], Counter[tuple[str, str]]()
    for index, site in enumerate(_sites(ast.parse(source))):
        seen[site.function, site.what] += 1
        nth = seen[site.function, site.what]
        what = site.what if nth == 1 else f"{site.what} (no. {nth})"
        found.append(Change(file, site.line, site.function, what, index, site.lines))
    return found


def changed(source: str, change: Change) -> ast.Module:
    """The syntax tree of a file after one change."""
    tree = ast.parse(source)
    next(site for i, site in enumerate(_sites(tree)) if i == change.index).make()
    return ast.fix_missing_locations(tree)


@dataclass(slots=True)
class _Site:
    function: str
    line: int
    lines: range
    what: str
    make: Callable[[], None]


def _sites(tree: ast.Module) -> Iterator[_Site]:
    """All that may be changed, in the order of the source."""
    for name, function in _functions(tree.body):
        yield from _below(function, name, range(0))


def _functions(body: list[ast.stmt], prefix: str = "") -> Iterator[tuple[str, ast.AST]]:
    """The functions of a file and the methods of its classes, with dotted names."""
    for node in body:
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                yield prefix + name, node
            case ast.ClassDef(name=name):
                yield from _functions(node.body, f"{prefix}{name}.")


def _below(node: ast.AST, function: str, lines: range) -> Iterator[_Site]:
    for field, value in ast.iter_fields(node):
        if _is_left_out(node, field):
            continue
        for i, each in enumerate(value if isinstance(value, list) else [value]):
            if not isinstance(each, ast.AST):
                continue
            within = _lines(each, lines)
            for what, make in _changes_of(each, value, i):
                line = getattr(each, "lineno", within.start)
                yield _Site(function, line, within, what + _head(_shown(each, node)), make)
            is_named = isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
            yield from _below(each, f"{function}.{each.name}" if is_named else function, within)


def _changes_of(
    node: ast.AST, siblings: object, i: int
) -> Iterator[tuple[str, Callable[[], None]]]:
    """(What is changed, what changes it) for one node, which may be the i-th of `siblings`."""

    def put(statement: ast.stmt) -> Callable[[], None]:
        assert isinstance(siblings, list)
        return lambda: siblings.__setitem__(i, ast.copy_location(statement, node))

    match node:
        case ast.Compare(ops=ops):
            for at, op in enumerate(ops):
                other = OTHER[type(op)]
                yield _to(type(op), other), lambda at=at, other=other: ops.__setitem__(at, other())
        case ast.BoolOp(op=op) | ast.BinOp(op=op) | ast.AugAssign(op=op) if type(op) in OTHER:
            other = OTHER[type(op)]
            yield _to(type(op), other), lambda: setattr(node, "op", other())
        case ast.Constant(value=bool(value)):
            yield f"{value} to {not value} in ", lambda: setattr(node, "value", not value)
        case ast.Constant(value=int(value) | float(value)):
            more = value + 1 if isinstance(value, int) and value < LARGE else 2 * value or 1.0
            yield f"{value} to {more} in ", lambda: setattr(node, "value", more)
        case ast.Call(func=ast.Name(id="min" | "max") as called):
            other_name = EXTREMES[called.id]
            yield f"{called.id} to {other_name} in ", lambda: setattr(called, "id", other_name)
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            opposite = ast.copy_location(ast.UnaryOp(ast.Not(), test), test)
            yield "negated ", lambda: setattr(node, "test", opposite)
        case ast.Return(value=ast.expr() as value) if not _is_a_flag(value):
            nothing = ast.copy_location(ast.Constant(None), value)
            yield "None for ", lambda: setattr(node, "value", nothing)
        case ast.Break() | ast.Continue():
            other = OTHER[type(node)]
            yield _to(type(node), other), put(other())
    if _is_deletable(node):
        yield "deleted ", put(ast.Pass())


def _to(one: type, other: type) -> str:
    return f"{SIGNS[one]} to {SIGNS[other]} in "


def _is_deletable(node: ast.AST) -> bool:
    match node:
        case ast.Expr(value=ast.Call() | ast.Await()) | ast.AugAssign():
            return True
        case ast.Assign(targets=[target]) | ast.AnnAssign(target=target, value=ast.expr()):
            return isinstance(target, ast.Attribute | ast.Subscript)
    return False


def _is_a_flag(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value in (None, True, False)


def _is_left_out(node: ast.AST, field: str) -> bool:
    """Whether a part of a node is not changed: words, types, and what runs only once."""
    match node:
        case ast.Raise() | ast.Assert() | ast.JoinedStr() | ast.arguments():
            return True
        case ast.FunctionDef(name="__repr__" | "__str__"):
            return True
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef() | ast.Lambda():
            return field != "body"
        case ast.AnnAssign() | ast.arg():
            return field == "annotation"
        case ast.If(test=ast.Name(id="TYPE_CHECKING")):
            return True
        case ast.Expr(value=ast.Call(func=ast.Attribute(value=ast.Name(id="_log")))):
            return True
    return False


def _lines(node: ast.AST, around: range) -> range:
    if isinstance(node, ast.match_case):
        return range(node.pattern.lineno, node.body[0].lineno)
    if not isinstance(node, ast.stmt):
        return around
    body = getattr(node, "body", None)
    end = body[0].lineno if body else (node.end_lineno or node.lineno) + 1
    return range(node.lineno, max(end, node.lineno + 1))


def _shown(node: ast.AST, parent: ast.AST) -> ast.AST:
    """A number alone says little."""
    return parent if isinstance(node, ast.Constant | ast.Break | ast.Continue) else node


def _head(node: ast.AST) -> str:
    """The text of a node; of a compound statement, its first line."""
    return ast.unparse(node).split("\n")[0].removesuffix(":")
