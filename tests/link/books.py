"""What the books of a link must say at any moment."""

from tests.link.world import tx


def assert_books_balance(link, seed):
    ledger = tx(link)
    assert link.audit() == [], f"seed {seed}"
    assert ledger.queued == sum(ledger.queued_by_class.values())
