"""Checks Python, the packages and the compiled modem."""

import re
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

from sdrlinkd.doctor.finding import Finding, bad, good, good_if
from sdrlinkd.extras import install_line

LEAST_PYTHON = (3, 11)
_REQUIREMENT = re.compile(r"([A-Za-z0-9_.\-]+)\s*(?:>=\s*([0-9.]+))?[^;]*(;.*)?")


def check_environment(
    requirements: list[str],
    version_of: Callable[[str], str],
    home: Path,
    phy_home: Path,
    library: Path | None,
) -> list[Finding]:
    """Findings on Python, the packages and the compiled modem.

    `requirements` are those of the package's metadata. `version_of` raises PackageNotFoundError.
    `home` is the folder with sdrlinkd, `phy_home` the one with phy, and `library` the compiled
    modem; None: there is none for this machine.
    """
    found = ".".join(map(str, sys.version_info[:3]))
    return [
        good_if(
            sys.version_info >= LEAST_PYTHON, "Python", found,
            f"install Python {'.'.join(map(str, LEAST_PYTHON))} or newer",
        ),
        _packages(requirements, version_of),
        good_if(
            home == phy_home, "modem's package", f"phy in {phy_home}",
            "another project's phy shadows it: install sdrlinkd into its own environment",
        ),
        good_if(
            library is not None, "compiled modem", str(library or "none for this machine"),
            "without it, the modem runs on NumPy, slowly; compile it: sdrlinkctl phy compile",
        ),
    ]  # fmt: skip


def _packages(requirements: list[str], version_of: Callable[[str], str]) -> Finding:
    wrong, needed, count = [], [], 0
    for text in requirements:
        name, least, marker = _REQUIREMENT.fullmatch(text.strip()).groups()  # type: ignore[union-attr]
        if marker:
            continue
        count += 1
        try:
            version = version_of(name)
        except metadata.PackageNotFoundError:
            wrong.append(f"{name} is missing")
        else:
            if not least or _numbers(version) >= _numbers(least):
                continue
            wrong.append(f"{name} {version} is older than {least}")
        needed.append(text)
    if wrong:
        return bad("packages", ", ".join(wrong), f"install them: {install_line(*needed)}")
    return good("packages", f"{count}, all installed")


def _numbers(version: str) -> list[int]:
    return [int(each) for each in re.findall(r"\d+", version)[:3]]
