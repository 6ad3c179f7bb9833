"""Sentences for the log, each said once."""

from collections import OrderedDict
from collections.abc import Callable

MOST = 1000
MOST_SHOWN = 400
"""Longest sentence, in characters: names in it may come from the air."""


class Sayings:
    """Says sentences through `say`, and remembers the last ones. Several threads use it."""

    def __init__(self, say: Callable[[str], object]) -> None:
        self._say = say
        self._said: OrderedDict[str, None] = OrderedDict()

    def say(self, text: str) -> None:
        """Say a sentence."""
        self._say(text[:MOST_SHOWN])

    def once(self, text: str) -> None:
        """Say a sentence, unless it was said before."""
        if text in self._said:
            return
        self._said[text] = None
        while len(self._said) > MOST:
            self._said.popitem(last=False)
        self.say(text)
