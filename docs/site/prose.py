"""Checks the English of everything that people read: `make check` runs it.

Pages: proselint, the length of sentences, and the words of WORDING. Python: the words of WORDING in
docstrings, comments and messages. It is a floor: what it does not find may still be hard to read.
"""

import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from proselint.checks import __register__
from proselint.config import DEFAULT
from proselint.registry import CheckRegistry
from proselint.tools import LintFile

from docs.site.stage import ROOT, documents

MOST_WORDS = 30
"""Words of the longest sentence on a page."""
PACKAGES = ("sdrlinkd", "backends", "phy", "benchmarks", "docs/site", "etc/gnuradio")
GENERATED = ("docs/benchmarks.md", "docs/reference/")
"""Pages whose text stands in Python, where it is checked; tables and lists make long sentences."""

WORDING = {
    r"\bcolours?\b": "color",
    r"\bneighbours?\b": "neighbor",
    r"\bcenter (frequency|of the channel)": "centre frequency: our term",
    r"\bradios? of metal\b": "physical radio",
    r"\bby the clock\b": "in real time",
    r"\bso long (it|as it) takes\b": "how long it takes",
    r"\b(is|are|was|were) looked for\b": "retried, or searched for",
    r"\bnobody goes on\b": "no node advances",
    r"\bwithout a word\b": "silently",
    r"\bwhat is to be sent\b": "the queue, or queued messages",
    r"\bowes? nothing\b": "incurs no debt",
    r"\bturn(s|ed)? round\b": "T/R switch, or turnaround",
    r"\btold apart\b": "distinguished",
    r"\bat hand over\b": "when it is handed over",
    r"\bback and forth\b": "in both directions",
    r"\bTODO\b|\bFIXME\b|\bXXX\b": "an issue, or nothing",
    r"\bin order to\b": "to",
    r"\butili[sz]e[sd]?\b": "use",
    r"\b(simply|basically|obviously|of course|very unique)\b": "leave it out",
    r"\bplease note\b": "leave it out",
    r"\btellings?\b|\bparcels?\b|\bspells? of sending\b": "see the glossary",
}
"""Words and phrases that the field does not use, and what to write."""

# proselint's typography wants curly quotes; its illusions are our tables; decimate is a key.
CONFIG = {
    **DEFAULT,
    "checks": {
        **DEFAULT["checks"],
        "typography": False,
        "lexical_illusions": False,
        "skunked_terms": False,
    },
}

_NOT_PROSE = re.compile(
    r"^```[\s\S]*?^```$|^ {4,}\S.*$|^\|.*$|`[^`\n]*`|^#.*$|\]\([^)]*\)|https?://\S+|^!\[.*$",
    re.MULTILINE,
)
_END = re.compile(r"(?<=[.!?:])[)\"*_]*\s+|\n\s*\n|\n(?=\s*(?:[-*]|\d+\.)\s)")
_WORD = re.compile(r"[A-Za-z][A-Za-z'\-]*")


class Finding(NamedTuple):
    """A place where a reader may stumble."""

    path: str
    line: int
    text: str


def of_page(path: str, text: str) -> Iterator[Finding]:
    """What is wrong with the prose of a page; code, tables and links are not prose."""
    prose = _NOT_PROSE.sub(lambda block: re.sub(r"[^\n]", " ", block[0]), text)
    for result in LintFile(path, prose).lint(CONFIG):
        # Its content begins with a line break of its own.
        yield Finding(path, max(1, result.pos[0] - 1), result.check_result.message)
    yield from _worded(path, prose)
    at = 0
    for sentence in _END.split(prose):
        start = prose.index(sentence, at)
        at = start + len(sentence)
        n_words = len(_WORD.findall(sentence))
        if n_words > MOST_WORDS:
            first = " ".join(sentence.split()[:6])
            line = prose.count("\n", 0, start) + 1
            yield Finding(path, line, f"{n_words} words in a sentence ({first} …)")


def of_python(path: str, text: str) -> Iterator[Finding]:
    """What is wrong with the wording of docstrings, comments and messages."""
    kinds = (tokenize.STRING, tokenize.COMMENT, getattr(tokenize, "FSTRING_MIDDLE", -1))
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in kinds:
            yield from _worded(path, token.string, token.start[0])


def _worded(path: str, text: str, first_line: int = 1) -> Iterator[Finding]:
    for pattern, better in WORDING.items():
        for found in re.finditer(pattern, text, re.IGNORECASE):
            line = first_line + text.count("\n", 0, found.start())
            yield Finding(path, line, f'"{found[0]}"; write: {better}')


def main() -> int:
    """Print all findings; 1 when there are any."""
    CheckRegistry().register_many(__register__)
    findings: list[Finding] = []
    n_pages = n_modules = 0
    for name in documents():
        if not name.startswith(GENERATED):
            n_pages += 1
            findings += of_page(name, (ROOT / name).read_text())
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            if path == Path(__file__).resolve():
                continue
            n_modules += 1
            findings += of_python(path.relative_to(ROOT).as_posix(), path.read_text())
    for each in findings:
        sys.stdout.write(f"{each.path}:{each.line}: {each.text}\n")
    n = len(findings)
    sys.stdout.write(f"prose: {n_pages} pages, {n_modules} modules, {n} findings\n")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
