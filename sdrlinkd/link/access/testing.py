"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.link.access import csma, tdma

__all__ = ["AFTER"]

AFTER = {"csma": (csma, "after"), "tdma": (tdma, "after")}
"""Where each policy finds `after`, which tests replace to look on."""
