"""The prose linter finds what it is for, and skips what is not prose."""

import pytest

from docs.site.prose import MOST_WORDS, of_page, of_python


def texts(found):
    return [(each.line, each.text) for each in found]


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        ("Fine.\n\nThe colour of the carrier.\n", 3, '"colour"; write: color'),
        ("# Title\n\nRadios of metal were tried.\n", 3, "physical radio"),
        ("One.\n\nWell, " + "word " * MOST_WORDS + "end.\n", 3, "words in a sentence"),
        ("It is very unique.\n", 1, "unique"),
    ],
)
def test_what_reads_badly_is_found(text, line, says):
    found = texts(of_page("page.md", text))
    assert any(at == line and says in message for at, message in found), found


@pytest.mark.parametrize(
    "text",
    [
        "A link to [the colors](colour.md).\n",
        "```sh\necho colour\n```\n",
        "`modem.colour` is a key.\n",
        "| colour | " + "word " * 50 + "|\n",
        "- One short point.\n- " + "another " * 15 + "\n- " + "more " * 15 + "\n",
    ],
)
def test_code_tables_and_lists_are_no_sentences(text):
    assert texts(of_page("page.md", text)) == []


def test_docstrings_comments_and_messages_are_read():
    code = '"""A radio of metal."""\n\nx = "without a word"  # of course\nof_course = 1\n'
    assert [line for line, _ in texts(of_python("x.py", code))] == [1, 3, 3]
