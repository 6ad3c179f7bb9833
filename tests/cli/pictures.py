"""Screens as text, compared with the stored ones in docs/screens."""

import os
from io import StringIO
from pathlib import Path

from rich.console import Console

SCREENS = Path(__file__).parents[2] / "docs" / "screens"
REWRITE = "REWRITE_SCREENS"
"""Environment variable with which the tests write the stored screens instead of comparing."""


def drawn(*renderables: object, width: int = 80, height: int | None = None) -> str:
    """What a terminal of that size shows, without colours and trailing blanks."""
    console = Console(file=StringIO(), width=width, legacy_windows=False, color_system=None)
    for each in renderables:
        console.print(each, highlight=False)
    lines = [line.rstrip() for line in console.file.getvalue().splitlines()]
    return "".join(f"{line}\n" for line in lines[:height])


def assert_stored(name: str, text: str) -> None:
    """Assert that `text` equals docs/screens/NAME.txt."""
    path = SCREENS / f"{name}.txt"
    if os.environ.get(REWRITE):
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    assert text == path.read_text(), f"{path.name} differs; {REWRITE}=1 writes it anew"
