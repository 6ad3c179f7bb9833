"""The shipped how-to pages."""

from dataclasses import dataclass
from pathlib import Path

from sdrlinkd.errors import UserError, did_you_mean
from sdrlinkd.shipped import shipped_files


@dataclass(frozen=True)
class HowTo:
    """A page that answers one question."""

    name: str
    """As `sdrlinkctl help NAME` takes it: the file's name."""
    title: str
    """Its heading, which says what it does for the reader."""
    text: str
    """The page in Markdown."""


def how_tos() -> list[HowTo]:
    """All pages, by name."""
    files = shipped_files("docs/howto", "howto", ".md")
    return [_read(path) for name, path in files.items() if name != "index"]


def find_how_to(name: str, others: list[str]) -> HowTo:
    """The page `name`. Raises UserError, which suggests one of them or of `others`."""
    pages = {each.name: each for each in how_tos()}
    if name in pages:
        return pages[name]
    hint = did_you_mean(name, [*pages, *others])
    raise UserError(
        f"help: got {name}, and there is no such page, word, key or command{hint}; "
        "`sdrlinkctl help` lists all pages"
    )


def _read(path: Path) -> HowTo:
    text = path.read_text()
    return HowTo(path.stem, text.split("\n", 1)[0].removeprefix("# ").strip(), text)
