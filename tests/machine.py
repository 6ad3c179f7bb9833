"""What a machine may lack: why a test is skipped there, reported in one line."""

from collections import Counter

PACKAGES = "needs packages: "
ROOT = "needs root"


def lacks(*packages: str) -> str:
    """Why a test is skipped if these Debian packages are not installed."""
    return PACKAGES + " ".join(packages)


def left_out(reasons: list[str]) -> str:
    """One line about all tests skipped for `reasons`; "" if there are none."""
    packages = sorted(
        {
            package
            for reason in reasons
            if reason.startswith(PACKAGES)
            for package in reason.removeprefix(PACKAGES).split()
        }
    )
    parts = []
    for kind, n in Counter(map(_kind, reasons)).most_common():
        tests = "1 test needs" if n == 1 else f"{n} tests need"
        if kind == PACKAGES:
            parts.append(f"{tests} system packages (apt-get install {' '.join(packages)})")
        elif kind == ROOT:
            parts.append(f"{tests} root")
        else:
            parts.append(f"{n} skipped: {kind}")
    return "; ".join(parts)


def _kind(reason: str) -> str:
    return next((kind for kind in (PACKAGES, ROOT) if reason.startswith(kind)), reason)
