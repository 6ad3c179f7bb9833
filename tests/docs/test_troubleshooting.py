"""Each quotation in docs/troubleshooting.md is in the code."""

import ast
import re
from pathlib import Path

import pytest

from sdrlinkd.config import Config

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/troubleshooting.md").read_text()
GAP = "…"
QUOTED = re.findall(r"^\| `([^`]+)` \|", PAGE, re.MULTILINE)


def text_of(node):
    """A string of the code, with a gap for each value in it; otherwise nothing."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        parts = (text_of(each) if isinstance(each, ast.Constant) else GAP for each in node.values)
        return "".join(parts)
    if isinstance(node, ast.BinOp):
        return text_of(node.left) + text_of(node.right)
    return ""


@pytest.fixture(scope="module")
def sentences():
    """All sentences that the daemon and its command line can print."""
    return {
        text_of(node)
        for folder in ("sdrlinkd", "backends")
        for path in (ROOT / folder).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Constant | ast.JoinedStr | ast.BinOp)
    }


def says(sentence, quoted):
    """Whether the quotation is in the sentence, word for word between its gaps."""
    parts = [re.escape(part.strip()) for part in quoted.split(GAP) if part.strip()]
    return re.search(".*".join(parts), sentence, re.DOTALL) is not None


@pytest.mark.parametrize("quoted", QUOTED)
def test_what_is_quoted_is_said(sentences, quoted):
    assert any(says(sentence, quoted) for sentence in sentences)


def test_the_page_quotes_and_a_made_up_sentence_is_not_said(sentences):
    assert len(QUOTED) > 25
    assert not any(says(sentence, "the flux of … is misaligned") for sentence in sentences)


def test_every_key_of_the_page_is_one_of_the_configuration():
    for key in set(re.findall(r"`([a-z]+\.[a-z_]+)(?: = [^`]*)?`", PAGE)):
        part = Config()
        for word in key.split("."):
            part = getattr(part, word)
