"""Scenarios that are shipped with the program, by name."""

from pathlib import Path

from sdrlinkd.errors import UserError, did_you_mean
from sdrlinkd.shipped import shipped_files


def shipped_scenarios() -> dict[str, Path]:
    """The files of shipped scenarios, by name."""
    return shipped_files("etc/scenarios", "scenarios", ".toml")


def find_scenario(given: Path) -> Path:
    """The file `given`, or the shipped scenario of that name. Raises UserError if there is none."""
    shipped = shipped_scenarios()
    if given.exists() or len(given.parts) != 1:
        return given
    name = given.name.removesuffix(".toml")
    if name in shipped or given.suffix == ".toml":
        return shipped.get(name, given)
    hint = did_you_mean(name, shipped)
    raise UserError(
        f"{given}: no such scenario{hint}; allowed: a TOML file, or one of {', '.join(shipped)}"
    )
