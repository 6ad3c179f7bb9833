"""Folders that come with the program, in the source tree or where a wheel puts them."""

import sysconfig
from pathlib import Path

IN_TREE = Path(__file__).parents[1]
INSTALLED = Path(sysconfig.get_path("data")) / "share/sdrlinkd"


def shipped_files(in_tree: str, installed: str, ending: str) -> dict[str, Path]:
    """Files of a shipped folder by their names without `ending`, sorted; empty if none is there."""
    folders = (IN_TREE / in_tree, INSTALLED / installed)
    found = next((folder for folder in folders if folder.is_dir()), None)
    paths = sorted(found.glob(f"*{ending}")) if found else []
    return {path.name.removesuffix(ending): path for path in paths}
