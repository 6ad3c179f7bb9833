"""Reads the docstrings of a struct's fields from the source; Python does not keep them."""

import ast
import functools
import inspect
import textwrap

import msgspec


@functools.cache
def field_texts(struct: type[msgspec.Struct]) -> dict[str, str]:
    """The text below each field of `struct` by name, its base classes' fields included.

    A field without a text is missing. A text is one paragraph, whatever its lines in the source.
    """
    found: dict[str, str] = {}
    for each in reversed(struct.__mro__):
        if issubclass(each, msgspec.Struct) and each is not msgspec.Struct:
            found |= _own_texts(each)
    return found


def summary_of(struct: type[msgspec.Struct]) -> str:
    """The first paragraph of a struct's docstring, as one line."""
    return one_line(inspect.getdoc(struct) or "")


def one_line(text: str) -> str:
    """The first paragraph of a docstring without its line breaks."""
    return " ".join(inspect.cleandoc(text).split("\n\n")[0].split())


def _own_texts(struct: type[msgspec.Struct]) -> dict[str, str]:
    tree = ast.parse(textwrap.dedent(inspect.getsource(struct))).body[0]
    found, name = {}, ""
    for node in getattr(tree, "body", ()):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            name = node.target.id
        elif (
            name
            and isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            found[name] = one_line(node.value.value)
            name = ""
        else:
            name = ""
    return found
