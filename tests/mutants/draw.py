"""What is changed: the packages, their files, and the lot that falls on some of the changes."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from math import ceil
from pathlib import Path
from random import Random

from tests.mutants.changes import Change, changed, changes
from tests.mutants.live import Live

PACKAGES = ("link", "wire", "sealing", "bus", "fleet", "calls", "phy")
BESIDE = {
    "link": ("tests/link", "tests/sealing", "tests/fuzz"),
    "wire": ("tests/wire", "tests/fuzz", "tests/link"),
    "sealing": ("tests/sealing", "tests/keyring", "tests/fuzz"),
    "bus": ("tests/bus", "tests/client", "tests/fuzz"),
    "calls": ("tests/ros", "tests/fleet"),
    "phy": ("tests/phy", "tests/modem"),
}
"""Where the tests of a package are, if not in the folder of its name alone."""
NOT_LIVE = ("phy/kernels/", "__main__.py")
"""Compiled ahead of time, or never imported."""


@dataclass
class Package:
    """A part of the product: its files, and the folders with its tests, relative to the root."""

    name: str
    root: Path
    files: list[str]
    tests: tuple[str, ...]

    @classmethod
    def find(cls, name: str, root: Path) -> "Package":
        """The package of this name. Raises ValueError if there is none."""
        for place in (root / "sdrlinkd" / name, root / name):
            if place.exists():
                paths = [place] if place.is_file() else sorted(place.rglob("*.py"))
                files = [str(path.relative_to(root)) for path in paths]
                top = name.split("/")[0]
                live = [file for file in files if not any(each in file for each in NOT_LIVE)]
                return cls(name, root, live, BESIDE.get(top, (f"tests/{top}",)))
        raise ValueError(f"there is no package {name}")

    @cached_property
    def n_lines(self) -> int:
        """Its size."""
        return sum(len(self.source(file).splitlines()) for file in self.files)

    @cached_property
    def changes(self) -> list[Change]:
        """All that can be changed."""
        return [each for file in self.files for each in changes(file, self.source(file))]

    def source(self, file: str) -> str:
        """The text of one of its files."""
        return (self.root / file).read_text()

    def draw(self, n: int, seed: int, live: Live) -> Iterator[tuple[Change, Callable[[], None]]]:
        """`n` changes, or all, with what makes each; a larger `n` draws more of the same."""
        return islice(self._drawn(seed, live), n)

    def _drawn(self, seed: int, live: Live) -> Iterator[tuple[Change, Callable[[], None]]]:
        for change in Random(f"{self.name} {seed}").sample(self.changes, len(self.changes)):
            path = self.root / change.file
            try:
                code = compile(changed(self.source(change.file), change), str(path), "exec")
                yield change, live.maker(path, code)
            except (SyntaxError, ValueError):
                continue


def measured(packages: Iterable[Package], root: Path) -> list[Path]:
    """The folders of which it is learnt what tests reach: whichever packages are asked for."""
    tops = {*PACKAGES, *(each.name.split("/")[0] for each in packages)}
    places = [place / top for top in sorted(tops) for place in (root / "sdrlinkd", root)]
    return [place for place in places if place.is_dir()]


def shares(packages: list[Package], n: int) -> list[int]:
    """How many of at least `n` each package gets, in proportion to its lines."""
    total = sum(each.n_lines for each in packages)
    return [ceil(n * each.n_lines / total) for each in packages]
