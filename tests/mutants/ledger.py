"""The ledger of survivors, `docs/measured/mutants.json`: figures, names, and the reasons given."""

import json
import platform
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tests.mutants.changes import Change

LEAST_KILLED, MOST_EQUIVALENT = 0.85, 0.05
"""Shares of the mutants that were drawn."""


@dataclass(slots=True)
class Row:
    """The figures of a package."""

    lines: int = 0
    drawn: int = 0
    killed: int = 0
    survived: int = 0
    equivalent: int = 0
    """Survivors that do the same as the program."""

    @property
    def rate(self) -> float:
        """The share of those killed that could be."""
        return self.killed / max(1, self.drawn - self.equivalent)

    @property
    def is_enough(self) -> bool:
        """Whether the tests notice enough, and few mutants are excused."""
        return self.rate >= LEAST_KILLED and self.equivalent <= MOST_EQUIVALENT * self.drawn


@dataclass(slots=True)
class Ledger:
    """What was found, and what people have written about it."""

    seed: int = 0
    python: str = ""
    packages: dict[str, Row] = field(default_factory=dict)
    planted: dict[str, str] = field(default_factory=dict)
    """Of each planted mutant, the test that fails, or why it may survive; "" if it should not."""
    survivors: list[dict[str, Any]] = field(default_factory=list)
    """`drawn`: in the last run; the others are kept for their reasons."""

    @classmethod
    def read(cls, path: Path) -> "Ledger":
        """The ledger that was kept last, or an empty one."""
        if not path.exists():
            return cls()
        told = json.loads(path.read_text())
        told["packages"] = {name: Row(**row) for name, row in told["packages"].items()}
        return cls(**told)

    def known(self, change: Change) -> tuple[str, bool]:
        """The reason once given for a survivor, and whether it is equivalent."""
        for each in self.survivors:
            if _key(each) == change.key:
                return each["reason"], each["equivalent"]
        return "", False

    def take(
        self, seed: int, rows: Mapping[str, Row], possible: Iterable[Change],
        tried: Mapping[Change, str], planted: Mapping[str, str],
    ) -> None:  # fmt: skip
        """Replace what is known of the packages of a run.

        `possible` are all changes of these packages. `tried` has the test that fails for each.
        """
        self.seed, self.python = seed, platform.python_version()
        self.packages |= rows
        self.planted |= planted
        killed = {change.key for change, failed in tried.items() if failed}
        now = {change.key: change for change in possible}
        files = {change.file for change in now.values()}
        survivors = [
            each for each in self.survivors
            if each["file"] not in files or (each["reason"] and _key(each) in now.keys() - killed)
        ]  # fmt: skip
        by_key = {_key(each): each for each in survivors}
        for change, failed in tried.items():
            if not failed and change.key not in by_key:
                reason = {"reason": "", "equivalent": False}
                names = dict(zip(("file", "function", "what"), change.key, strict=True))
                by_key[change.key] = names | reason
        for key, each in by_key.items():
            if key in now:
                each |= {"line": now[key].line, "drawn": now[key] in tried}
        self.survivors = sorted(by_key.values(), key=lambda each: (each["file"], each["line"]))

    def keep(self, path: Path) -> None:
        """Write the ledger."""
        path.write_text(json.dumps(asdict(self), indent=1, ensure_ascii=False) + "\n")


def _key(entry: Mapping[str, str]) -> tuple[str, str, str]:
    return entry["file"], entry["function"], entry["what"]
