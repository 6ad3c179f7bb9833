"""What a page has its reader type and write, and what the screen shows then."""

import re
from dataclasses import dataclass

from docs.site.stage import ROOT

_BLOCK = re.compile(r"^```(\w+) ?(.*?)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# What a shown line has that a screen must have, too: numbers, paths and lines of tables differ.
_WORD = re.compile(r"(?<![\w./])[A-Za-z_][A-Za-z_]+(?![\w./])")


@dataclass(frozen=True)
class Command:
    """A line behind `$`, who types it, and the lines shown below it."""

    who: str
    line: str
    shown: tuple[str, ...]

    @property
    def runs_on(self) -> bool:
        """Whether the reader goes on typing while it runs."""
        return self.line.endswith("&")


@dataclass(frozen=True)
class File:
    """A block with a title: the reader saves it under that name."""

    name: str
    text: str


def blocks(page, *languages):
    """(rest of the first line, text) of a page's blocks in any of these languages."""
    text = (ROOT / page).read_text()
    return [(rest, body) for language, rest, body in _BLOCK.findall(text) if language in languages]


def steps_of(text):
    """The commands and files of a page, in order."""
    found = []
    for language, rest, body in _BLOCK.findall(text):
        title = re.fullmatch(r'title="(.+)"', rest)
        if title:
            found.append(File(title[1], body))
        elif language == "console":
            for each in re.split(r"^\$ ", body, flags=re.MULTILINE)[1:]:
                line, *shown = each.rstrip("\n").split("\n")
                found.append(Command(rest, line, tuple(shown)))
    return found


def commands_of(text):
    """All commands of a page, in order."""
    return [each for each in steps_of(text) if isinstance(each, Command)]


def missing_words(shown, screen):
    """Words of the lines shown that the screen does not have, by line.

    A line without figures and `…` must be there as it is.
    """
    there = set(_WORD.findall(screen))
    lines = {" ".join(line.split()) for line in screen.splitlines()}
    found = {}
    for line in shown:
        lost = [word for word in _WORD.findall(line) if word not in there]
        is_exact = line.strip() and not re.search(r"[\d…─]", line)
        if not lost and is_exact and " ".join(line.split()) not in lines:
            lost = [line]
        if lost:
            found[line] = lost
    return found
