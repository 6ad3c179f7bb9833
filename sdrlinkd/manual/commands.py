"""The reference pages of programs, from their command trees."""

import inspect
from collections.abc import Iterator
from typing import Any

# Any: typer brings its own copy of click, whose types are not public.
Command = Any
Context = Any


def commands_page(name: str, command: Command, sentence: str) -> str:
    """The page of program `name` in Markdown: a section for each command, options below it."""
    parts = [f"# {name}", "", sentence, ""]
    root = command.context_class(command, info_name=name)
    for context in _leaves(root):
        own = context.command
        usage = " ".join([context.command_path, *own.collect_usage_pieces(context)])
        title = [f"## {context.command_path}", ""] if context is not root else []
        parts += [*title, inspect.cleandoc(own.help or ""), "", f"    {usage}", ""]
        parts += [_entry(*record) for record in _records(context)]
    return "\n".join(parts)


def _leaves(context: Context) -> Iterator[Context]:
    """Contexts of all commands that do something by themselves."""
    own = context.command
    below = getattr(own, "commands", {})
    if not below or (own.invoke_without_command and context.parent):
        yield context
    for name, each in below.items():
        if not each.hidden:
            yield from _leaves(each.context_class(each, info_name=name, parent=context))


def _records(context: Context) -> Iterator[tuple[str, str]]:
    for parameter in context.command.params:
        record = parameter.get_help_record(context)
        if record is not None:
            yield record


def _entry(head: str, text: str) -> str:
    return f"`{head}`\n:   {text or 'See above.'}\n"
