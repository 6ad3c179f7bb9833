"""Keeps results in docs/measured, from which docs/benchmarks.md and its pictures are made."""

import json
import math
import os
import platform
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parents[1] / "docs"
FOLDER = DOCS / "measured"
FIGURES = DOCS / "figures"


def circumstances(stolen_pct: float) -> dict[str, Any]:
    """Machine and date of a run, and its stolen time in % of all cores."""
    return {
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}",
        "stolen_pct": round(stolen_pct, 2),
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
    }


def keep(name: str, report: dict[str, Any]) -> Path:
    """Write the report of benchmark `name`; returns its path."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"{name}.json"
    path.write_text(json.dumps(_plain(report), indent=1, ensure_ascii=False) + "\n")
    return path


def kept(name: str) -> dict[str, Any] | None:
    """The latest kept report of benchmark `name`; None if there is none."""
    path = FOLDER / f"{name}.json"
    if not path.exists():
        return None
    report: dict[str, Any] = json.loads(path.read_text())
    return report


def _plain(value: object) -> object:
    """The value as JSON holds it: null for NaN, lists for arrays, five digits of each figure."""
    if isinstance(value, dict):
        return {str(key): _plain(each) for key, each in value.items()}
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float):
        return float(f"{value:.5g}") if math.isfinite(value) else None
    return value
