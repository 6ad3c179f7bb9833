"""Checks Python, the packages and the compiled modem."""

import os
import re
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

from sdrlinkd.doctor.finding import Finding, bad, good, good_if

LEAST_PYTHON = (3, 11)
_REQUIREMENT = re.compile(r"([A-Za-z0-9_.\-]+)\s*(?:>=\s*([0-9.]+))?[^;]*(;.*)?")


def check_environment(
    requirements: list[str],
    version_of: Callable[[str], str],
    home: Path,
    phy_home: Path,
    cache: Path,
) -> list[Finding]:
    """Findings on Python, the packages and the compiled modem.

    `requirements` are those of the package's metadata. `version_of` raises PackageNotFoundError.
    `home` is the folder with sdrlinkd, `phy_home` the one with phy, and `cache` the folder of the
    compiled code.
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
        _compiled(cache),
    ]  # fmt: skip


def _packages(requirements: list[str], version_of: Callable[[str], str]) -> Finding:
    wrong, count = [], 0
    for text in requirements:
        name, least, marker = _REQUIREMENT.fullmatch(text.strip()).groups()  # type: ignore[union-attr]
        if marker:
            continue
        count += 1
        try:
            version = version_of(name)
        except metadata.PackageNotFoundError:
            wrong.append(f"{name} is missing")
            continue
        if least and _numbers(version) < _numbers(least):
            wrong.append(f"{name} {version} is older than {least}")
    if wrong:
        return bad("packages", ", ".join(wrong), "reinstall sdrlinkd: pip install .")
    return good("packages", f"{count}, all installed")


def _numbers(version: str) -> list[int]:
    return [int(each) for each in re.findall(r"\d+", version)[:3]]


def _compiled(cache: Path) -> Finding:
    kernels = len(list(cache.rglob("*.nbi"))) if cache.is_dir() else 0
    compile_it = f"{sys.executable} -c 'import phy; phy.warm_up()'"
    if kernels:
        return good("compiled modem", f"{kernels} kernels in {cache}")
    folder = cache if cache.is_dir() else cache.parent
    if os.access(folder, os.W_OK):
        return bad(
            "compiled modem", f"none in {cache}: the first start takes minutes",
            f"compile it now: {compile_it}",
        )  # fmt: skip
    return bad(
        "compiled modem", f"none in {cache}, and this user may not write there",
        f"as the user who may: {compile_it}; or name a folder: export NUMBA_CACHE_DIR=FOLDER",
    )  # fmt: skip
