"""The commands that a page tells its reader to type, and the screens that it shows."""

import re
from dataclasses import dataclass

_BLOCK = re.compile(r"^```console ?(.*?)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# The parts of a shown line that a screen must contain, too: numbers, paths and table lines differ.
_WORD = re.compile(r"(?<![\w./])[A-Za-z_][A-Za-z_]+(?![\w./])")


@dataclass(frozen=True)
class Command:
    """A line after `$`, who types it, and the lines shown below it."""

    who: str
    line: str
    shown: tuple[str, ...]

    @property
    def runs_on(self) -> bool:
        """Whether the reader continues to type while it runs."""
        return self.line.endswith("&")


def commands_of(text):
    """All commands of a page, in order."""
    found = []
    for block in _BLOCK.finditer(text):
        for each in re.split(r"^\$ ", block[2], flags=re.MULTILINE)[1:]:
            line, *shown = each.rstrip("\n").split("\n")
            found.append(Command(block[1], line, tuple(shown)))
    return found


def missing_words(shown, screen):
    """Words of the shown lines that are not on the screen, by line."""
    there = set(_WORD.findall(screen))
    return {
        line: lost
        for line in shown
        if (lost := [word for word in _WORD.findall(line) if word not in there])
    }
