"""Collects the pages of the site in build/pages, with links that hold there.

Most pages are in docs/. Documents beside the code are pages too, so staging rewrites their links
and the links to them. A link to a file that is not a page, such as a module, becomes plain text.
"""

import re
import shutil
import sys
from pathlib import Path
from posixpath import normpath, relpath

ROOT = Path(__file__).parents[2]
STAGED = ROOT / "build" / "pages"
SITE, STYLE = "zensical.toml", "tables.css"
NOT_PAGES = ("man", "measured", "screens", "site")
"""Folders of docs/ that hold no pages."""

BESIDE_CODE = {
    "radios/gnuradio.md": "etc/gnuradio/README.md",
    "radios/ether.md": "backends/ether/README.md",
    "radios/test-radio.md": "tests/soapy_loopback/README.md",
    "radios/adding.md": "backends/README.md",
    "radios/index.md": "docs/radios/README.md",
    "reference/bus.md": "sdrlinkd/bus/README.md",
    "reference/fleet.md": "sdrlinkd/fleet/README.md",
    "reference/wire.md": "sdrlinkd/wire/README.md",
    "reference/link.md": "sdrlinkd/link/README.md",
    "reference/phy.md": "phy/README.md",
    "reference/systemd.md": "systemd/README.md",
    "reference/client.md": "etc/client/README.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
}
"""Pages of the site, and the documents of the tree that they are."""
STANDS_FOR = {"README.md": "index.md"}
"""Documents that are no page, and the page that has the same for readers of the site."""

_BLOCK = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[([^\]]+)\]\((?!https?:|mailto:|#|<)([^)\s#]+)(#[^)\s]*)?\)")


class DeadLinkError(Exception):
    """A document links to a file that does not exist; the message names both."""


def pages() -> dict[str, str]:
    """All pages of the site by their path there: the documents of the tree that they are."""
    docs = ROOT / "docs"
    found = {
        path.relative_to(docs).as_posix(): path.relative_to(ROOT).as_posix()
        for path in sorted(docs.rglob("*.md"))
        if path.relative_to(docs).parts[0] not in NOT_PAGES
    }
    taken = set(BESIDE_CODE.values())
    return {page: each for page, each in found.items() if each not in taken} | BESIDE_CODE


def documents() -> list[str]:
    """All documents that people read, by their path in the tree."""
    return sorted({*pages().values(), *STANDS_FOR})


def staged_text(page: str, source: str, page_of: dict[str, str]) -> str:
    """The document `source` as the page `page`. Raises DeadLinkError."""

    def resolved(link: re.Match[str]) -> str:
        text, path, anchor = link[1], link[2], link[3] or ""
        target = normpath(f"{Path(source).parent.as_posix()}/{path}")
        if not (ROOT / target).exists():
            raise DeadLinkError(f"{source}: links to {path}, which does not exist")
        if target.startswith("docs/figures/"):
            there = target.removeprefix("docs/")
        elif target in page_of:
            there = page_of[target]
        else:
            return text
        return f"[{text}]({relpath(there, Path(page).parent.as_posix())}{anchor})"

    parts = _BLOCK.split((ROOT / source).read_text())
    parts[::2] = [_LINK.sub(resolved, part) for part in parts[::2]]
    return "".join(parts)


def main() -> int:
    """Stage all pages and pictures; 1 where a link is dead."""
    shutil.rmtree(STAGED, ignore_errors=True)
    made = pages()
    page_of = {source: page for page, source in made.items()} | STANDS_FOR
    try:
        for page, source in made.items():
            path = STAGED / page
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(staged_text(page, source, page_of))
    except DeadLinkError as error:
        sys.stderr.write(f"docs: {error}\n")
        return 1
    shutil.copytree(ROOT / "docs" / "figures", STAGED / "figures")
    shutil.copy(Path(__file__).parent / SITE, STAGED.parent)
    shutil.copy(Path(__file__).parent / STYLE, STAGED)
    sys.stdout.write(f"staged {len(made)} pages\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
