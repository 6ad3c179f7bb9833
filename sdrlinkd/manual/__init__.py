"""The manual: reference pages made from the code, and the shipped how-to pages.

It turns types, commands and files into Markdown. It prints nothing and queries no daemon.
"""

from sdrlinkd.manual.attributes import field_texts, summary_of
from sdrlinkd.manual.commands import commands_page
from sdrlinkd.manual.configuration import configuration_page
from sdrlinkd.manual.howto import HowTo, find_how_to, how_tos
from sdrlinkd.manual.keys import Key, Section, find_key, key_names, sections
from sdrlinkd.manual.python_client import python_client_page
from sdrlinkd.manual.snapshot import snapshot_page
from sdrlinkd.manual.words import Word, glossary

__all__ = [
    "HowTo",
    "Key",
    "Section",
    "Word",
    "commands_page",
    "configuration_page",
    "field_texts",
    "find_how_to",
    "find_key",
    "glossary",
    "how_tos",
    "key_names",
    "python_client_page",
    "sections",
    "snapshot_page",
    "summary_of",
]
