"""Writes the reference pages and man pages that are made from the code: `make reference`."""

import sys
from importlib import import_module
from pathlib import Path

import pypandoc
import typer

from sdrlinkd import __version__, exporter, manual
from sdrlinkd.cli import ether, gateway
from sdrlinkd.cli.app import app
from sdrlinkd.cli.commands import COMMANDS

DOCS = Path(__file__).parents[1]
MAN_PAGES = {
    "sdrlinkctl.1": ("sdrlinkctl", "inspects and controls sdrlinkd"),
    "sdrlink-ether.1": ("sdrlink-ether", "the hub of a simulated air for sdrlinkd"),
    "sdrlink-gateway.1": ("sdrlink-gateway", "joins the robots of sdrlinkd to a fleet over Zenoh"),
    "sdrlinkd.toml.5": ("configuration", "the configuration of sdrlinkd"),
    "sdrlinkd.8": ("sdrlinkd", "carries ROS 2 messages between robots over software radio"),
}
"""Man pages by name: the reference page that each is, and the line of its NAME section."""


def pages() -> dict[str, str]:
    """The generated reference pages by name, in Markdown."""
    for each in COMMANDS.values():
        for module in each.modules:
            import_module(f"sdrlinkd.cli.{module}")
    return {
        "configuration": manual.configuration_page(),
        "snapshot": manual.snapshot_page(),
        "metrics": exporter.metrics_page(),
        "python": manual.python_client_page(),
        "sdrlinkctl": manual.commands_page(
            "sdrlinkctl",
            typer.main.get_group(app),
            "`sdrlinkctl` inspects and controls a running daemon. It also plans, records, replays "
            "and measures without one. `--install-completion` teaches a shell its commands and the "
            "names of topics, robots and fields. `sdrlinkctl help` lists the how-to pages.\n\n"
            "Exit codes: 0, done; 1, the answer is no, or something was lost; 2, a mistake to "
            "correct; 130, interrupted. `status` has codes of its own.",
        ),
        "sdrlink-ether": manual.commands_page(
            "sdrlink-ether",
            typer.main.get_command(ether.app),
            'Daemons with `backend = "ether"` share one simulated air, of which this is the hub.',
        ),
        "sdrlink-gateway": manual.commands_page(
            "sdrlink-gateway",
            typer.main.get_command(gateway.app),
            "A gateway runs beside a daemon and reads the same file, section `[fleet]`. It needs "
            "the extra `zenoh`. `sdrlinkctl help fleet` shows how to use it.",
        ),
    }


def man_page(name: str, markdown: str) -> str:
    """The man page `name` from its reference page."""
    program, _, section = name.rpartition(".")
    _, body = markdown.split("\n", 1)
    text = f"## Name\n\n{program} - {MAN_PAGES[name][1]}\n\n## Description\n{body}"
    page: str = pypandoc.convert_text(
        text, "man", format="markdown-tex_math_dollars", extra_args=[
            "--standalone", "--shift-heading-level-by=-1", f"--metadata=title:{program}",
            f"--metadata=section:{section}", f"--metadata=footer:sdrlinkd {__version__}",
        ],
    )  # fmt: skip
    return page


def main() -> int:
    """Write all of them below docs/."""
    made = pages()
    for name, text in made.items():
        (DOCS / "reference" / f"{name}.md").write_text(text)
    (DOCS / "man").mkdir(exist_ok=True)
    for name, (page, _) in MAN_PAGES.items():
        text = (DOCS / "reference" / f"{page}.md").read_text()
        (DOCS / "man" / name).write_text(man_page(name, text))
    sys.stdout.write(f"wrote {len(made)} pages and {len(MAN_PAGES)} man pages\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
