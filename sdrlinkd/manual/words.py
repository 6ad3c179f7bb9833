"""The glossary, whose words people ask for first."""

import re
from typing import NamedTuple

from sdrlinkd.shipped import shipped_files

_ROW = re.compile(r"^\| ([^|]+) \| ([^|]+) \| ([^|]*)\|$", re.MULTILINE)


class Word(NamedTuple):
    """A word of this field: what it means, and what other fields call it."""

    name: str
    meaning: str
    elsewhere: str


def glossary() -> dict[str, Word]:
    """The words in lower case; a row with several words, such as `SNR, RSSI`, has each of them."""
    text = shipped_files("docs", ".", ".md")["glossary"].read_text()
    found = {}
    for heads, meaning, elsewhere in _ROW.findall(text):
        if heads == "word" or set(heads) <= {"-"}:
            continue
        word = Word(heads, meaning.strip(), elsewhere.strip())
        for head in (heads, *heads.split(", ")):
            found[head.lower()] = word
    return found
