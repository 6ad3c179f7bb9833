"""Log lines with the journal's priorities, if the journal reads them."""

import logging
import os
import sys

_PRIORITIES = {
    logging.DEBUG: 7,
    logging.INFO: 6,
    logging.WARNING: 4,
    logging.ERROR: 3,
    logging.CRITICAL: 2,
}


def is_read_by_journal() -> bool:
    """Whether stderr is connected to the journal (systemd.exec(5), $JOURNAL_STREAM)."""
    try:
        found = os.fstat(sys.stderr.fileno())
    except (OSError, ValueError):
        return False
    return os.environ.get("JOURNAL_STREAM") == f"{found.st_dev}:{found.st_ino}"


class JournalFormatter(logging.Formatter):
    """Begins each line with its priority in angle brackets (sd-daemon(3))."""

    def format(self, record: logging.LogRecord) -> str:
        """The record as text, with the priority on every line."""
        mark = f"<{_PRIORITIES.get(record.levelno, 5)}>"
        return "\n".join(mark + line for line in super().format(record).splitlines())


def log_to_stderr(level: int) -> None:
    """Log what is as important as `level`, in the form that the reader of stderr expects."""
    text = "%(levelname)s %(message)s" if level <= logging.DEBUG else "%(message)s"
    handler = logging.StreamHandler()
    make = JournalFormatter if is_read_by_journal() else logging.Formatter
    handler.setFormatter(make(text))
    logging.basicConfig(level=level, handlers=[handler])
