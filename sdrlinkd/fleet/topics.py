"""Which topics a list of patterns names."""

import fnmatch
from collections.abc import Iterable


def matches(topic: str, patterns: Iterable[str]) -> bool:
    """Whether one of `patterns` names a topic; it has no leading slash."""
    return any(fnmatch.fnmatchcase(topic, pattern) for pattern in patterns)
