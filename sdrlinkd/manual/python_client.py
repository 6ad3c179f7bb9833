"""The reference page of the Python client, from its signatures and docstrings."""

import inspect
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass

from sdrlinkd import client

INTRODUCTION = """\
# Python client

`sdrlinkd.client` is what user programs import. It needs pyzmq and nothing else, and runs on
Python 3.10 and newer.
[Connect ROS 2 nodes](../howto/connect-ros2.md) has examples.
ROS 2 teams use [the bridge](../ros.md).
"""
CLASSES = (
    client.Publisher, client.Subscriber, client.AsyncPublisher, client.AsyncSubscriber,
    client.Message, client.Receipt, client.ControlClient, client.NoDaemonError,
    client.MessageRefusedError, client.RefusedError,
)  # fmt: skip


def python_client_page() -> str:
    """The page in Markdown: a section for each class, an entry for each method and field."""
    parts = [INTRODUCTION]
    for each in CLASSES:
        parts += [f"## {each.__name__}", "", *_head(each), _text(each), "", *_entries(each)]
    return "\n".join(parts)


def _head(of: type) -> list[str]:
    if issubclass(of, Exception) or is_dataclass(of):
        return []
    return [f"    {of.__name__}{_signature(of.__init__)}", ""]


def _entries(of: type) -> Iterator[str]:
    if is_dataclass(of):
        names = ", ".join(f"`{field.name}: {field.type}`" for field in fields(of))
        yield f"Fields: {names}.\n"
        return
    if issubclass(of, Exception):
        return
    for name, member in vars(of).items():
        if name.startswith("_") or not inspect.isfunction(member):
            continue
        yield f"`{name}{_signature(member)}`\n:   {_indented(_text(member))}\n"


def _signature(method: object) -> str:
    """The signature of a method without `self`."""
    found = inspect.signature(method)  # type: ignore[arg-type]
    parameters = list(found.parameters.values())[1:]
    text = str(found.replace(parameters=parameters, return_annotation=inspect.Signature.empty))
    returned = found.return_annotation
    if returned not in (inspect.Signature.empty, None, "None"):
        text += f" → {getattr(returned, '__name__', returned)}"
    # Names without their modules.
    return re.sub(r"\b(?:[a-z_]\w*\.)+(?=[A-Z])", "", text.replace("'", ""))


def _text(of: object) -> str:
    return inspect.getdoc(of) or ""


def _indented(text: str) -> str:
    return text.replace("\n", "\n    ")
