"""Files of a command's report and pictures: checked before a long run, written after it."""

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType

import msgspec

from sdrlinkd.errors import UserError
from sdrlinkd.extras import needs

REPORT = "report.json"


def load_pictures(package: str) -> ModuleType:
    """The module `package`.pictures, imported late as matplotlib is slow to load and optional.

    Raises UserError.
    """
    with needs("plots"):
        return import_module(f"{package}.pictures")


def make_folder(out: Path, pictures: Sequence[str]) -> None:
    """Make a folder and check that report and pictures can be written there. Raises UserError."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name in (REPORT, *pictures):
            (out / name).open("ab").close()
    except OSError as error:
        raise UserError(f"{error.filename} cannot be written ({error.strerror})") from None


def write_report(path: Path, report: msgspec.Struct) -> None:
    """Write a report as JSON for people and programs. Raises UserError."""
    text = msgspec.json.format(msgspec.json.encode(report), indent=2)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text + b"\n")
    except OSError as error:
        raise UserError(f"{path} cannot be written ({error.strerror})") from None
