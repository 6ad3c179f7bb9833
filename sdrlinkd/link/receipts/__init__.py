"""Receipts: what became of messages, for producers that want to know.

This package holds the table of messages for which receipts are outstanding, and the verdicts for
their producers. It never sends: it makes RECEIPT records for other robots and hands them to
`transmit`.
"""

from sdrlinkd.link.receipts.receipts import Receipts, Verdict, make_receipt

__all__ = [
    "Receipts",
    "Verdict",
    "make_receipt",
]
