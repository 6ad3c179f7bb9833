"""Scenarios that are shipped with the program, by name."""

import sysconfig
from difflib import get_close_matches
from pathlib import Path

from sdrlinkd.errors import UserError

# In the source tree, and where a wheel puts them.
FOLDERS = (
    Path(__file__).parents[2] / "etc/scenarios",
    Path(sysconfig.get_path("data")) / "share/sdrlinkd/scenarios",
)


def shipped_scenarios() -> dict[str, Path]:
    """The files of shipped scenarios, by name."""
    found = next((folder for folder in FOLDERS if folder.is_dir()), None)
    return {} if found is None else {path.stem: path for path in sorted(found.glob("*.toml"))}


def find_scenario(given: Path) -> Path:
    """The file `given`, or the shipped scenario of that name. Raises UserError if there is none."""
    shipped = shipped_scenarios()
    if given.exists() or len(given.parts) != 1:
        return given
    name = given.name.removesuffix(".toml")
    if name in shipped or given.suffix == ".toml":
        return shipped.get(name, given)
    close = get_close_matches(name, shipped, n=1)
    hint = f"; did you mean {close[0]}?" if close else ""
    raise UserError(
        f"{given}: no such scenario{hint}; allowed: a TOML file, or one of {', '.join(shipped)}"
    )
