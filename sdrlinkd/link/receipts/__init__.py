"""What became of messages whose producers want to know.

This room owns the table of messages that robots have still to answer, and the verdicts for their
producers. It never sends: a RECEIPT for another robot is made here and handed to `transmit`.
"""

from sdrlinkd.link.receipts.receipts import Receipts, Verdict, make_receipt

__all__ = [
    "Receipts",
    "Verdict",
    "make_receipt",
]
