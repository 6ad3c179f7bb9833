"""Finds the line of a key in a TOML file; errors cite it as `file:line: section.key`."""

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

# Keys, and the indices inside lists.
KeyPath = list[str | int]

_KEY = re.compile(r"[A-Za-z_]\w*(?:\.(?:\w+|\"[^\"]*\"))*")


def cite(source: str, text: str, path: KeyPath) -> str:
    """`file:line: section.key`, without the line if it cannot be found."""
    line = _line_of(text, path)
    name = ".".join(step for step in path if isinstance(step, str))
    return f"{source}:{line}: {name}" if line else f"{source}: {name}"


def located(message: str, source: str) -> str:
    """`message`, which begins with a key, prefixed with the file and the key's line.

    `source` is empty if there is no file. If the file does not contain the key, the line is that
    of the next key in the message, or else of the section.
    """
    if not source:
        return message
    plain = message.removeprefix(f"{source}: ")
    try:
        text = Path(source).read_text()
    except (OSError, ValueError):
        return f"{source}: {plain}"
    paths = list(_keys_in(plain))
    lines = [_line_of(text, path, exact=True) for path in paths] + [
        _line_of(text, path) for path in paths[:1]
    ]
    line = next((each for each in lines if each), None)
    return f"{source}:{line}: {plain}" if line else f"{source}: {plain}"


def _keys_in(message: str) -> Iterator[KeyPath]:
    """Words of a message that look like keys, in order; the file shows whether they are."""
    for found in _KEY.finditer(message):
        yield [part.strip('"') for part in re.findall(r"\"[^\"]*\"|\w+", found[0])]


def _line_of(text: str, path: KeyPath, *, exact: bool = False) -> int | None:
    """Line of `path` in the TOML text.

    If the key does not appear literally, it is the section's line, or None with `exact`.
    """
    section: KeyPath = []
    tables: Counter[str] = Counter()
    best = None
    for number, line in enumerate(text.splitlines(), start=1):
        header = re.match(r"\s*(\[{1,2})([^\[\]]+)\]", line)
        if header:
            parts = [part.strip().strip("\"'") for part in header[2].split(".")]
            tables[".".join(parts)] += header[1] == "[["
            section = _section(parts, tables)
            is_around = section == path[: len(section)] and not (exact and len(section) < 2)
            # The file has `[[link]]` where a table is required.
            if is_around or (best is None and section[: len(path)] == path):
                best = number
            continue
        key = re.match(r"\s*([\w\"'.\-]+)\s*=", line)
        if key:
            dotted = [*section, *(part.strip("\"'") for part in key[1].split("."))]
            if dotted == path[: len(dotted)]:
                return number
    return best


def _section(parts: list[str], tables: Counter[str]) -> KeyPath:
    """The path of a section header, with the index in each array of tables around it."""
    section: KeyPath = []
    for i, part in enumerate(parts):
        section.append(part)
        n = tables[".".join(parts[: i + 1])]
        if n:
            section.append(n - 1)
    return section
