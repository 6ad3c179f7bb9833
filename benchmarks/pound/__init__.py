"""The experiments of the Pound paper, section VI: our link, and what a team would use instead."""
