"""The reference page of the configuration."""

from sdrlinkd.manual.keys import Key, Section, sections

INTRODUCTION = """\
# Configuration

A daemon reads one TOML file: `sdrlinkd --config FILE`, by default `/etc/sdrlinkd/sdrlinkd.toml`.
Every key has a default. `sdrlinkd --check --config FILE` checks a file and prints what follows from
it; `sdrlinkctl init` writes one to begin with; `sdrlinkctl help KEY` prints an entry of this page.

Times, frequencies and rates also take text with a unit: `"300 ms"`, `"433.92 MHz"`, `"2 Msps"`.
Topic policies are read again on reload (`sdrlinkctl reload`); a radio that refused its settings is
tried again with the new ones. Everything else needs a restart.
"""
ABOVE = "Above all tables"


def configuration_page() -> str:
    """The page in Markdown: a section for each table, an entry for each key."""
    return "\n".join([INTRODUCTION, *(_section(each) for each in sections())])


def _section(section: Section) -> str:
    title = f"\\[{section.name}\\]" if section.name else ABOVE
    text = section.text if section.name else ""
    lines = [f"## {title}", "", *([text, ""] if text else [])]
    for key in section.keys:
        lines += [_entry(key), ""]
    return "\n".join(lines)


def _entry(key: Key) -> str:
    default = f"Default: `{key.default}`." if key.default else "Absent by default."
    return f"`{key.path}`\n:   {key.text}\n    Takes {key.allowed}. {default}"
