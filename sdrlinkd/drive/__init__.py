"""A drive as one file: kept while it happens, read again, and made into a page.

The page needs matplotlib and Jinja2, which are extras: it is loaded on first use.
"""

from typing import TYPE_CHECKING

from sdrlinkd.drive.keeping import Chronicle, keep
from sdrlinkd.drive.names import DRIVE, Event, received, sent
from sdrlinkd.drive.reading import Drive, read_drive
from sdrlinkd.drive.run_drive import RunDrive
from sdrlinkd.drive.writer import DriveWriter

if TYPE_CHECKING:
    from sdrlinkd.drive.page import report_page

__all__ = [
    "DRIVE",
    "Chronicle",
    "Drive",
    "DriveWriter",
    "Event",
    "RunDrive",
    "keep",
    "read_drive",
    "received",
    "report_page",
    "sent",
]


def __getattr__(name: str) -> object:
    """Import what draws on first use (PEP 562)."""
    if name == "report_page":
        from sdrlinkd.drive.page import report_page

        return report_page
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
