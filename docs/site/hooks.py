"""What MkDocs calls: documents from beside the code, and links that hold in the tree and here."""

import re
from pathlib import Path
from posixpath import normpath, relpath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]

INCLUDED = {
    "radios/gnuradio.md": "etc/gnuradio/README.md",
    "radios/ether.md": "backends/ether/README.md",
    "radios/test-radio.md": "tests/soapy_loopback/README.md",
    "radios/adding.md": "backends/README.md",
    "radios/index.md": "docs/radios/README.md",
    "reference/bus.md": "sdrlinkd/bus/README.md",
    "reference/wire.md": "sdrlinkd/wire/README.md",
    "reference/link.md": "sdrlinkd/link/README.md",
    "reference/phy.md": "phy/README.md",
    "reference/systemd.md": "systemd/README.md",
    "reference/client.md": "etc/client/README.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
}
"""Pages of the site, and the documents of the source tree that they are."""
ON_SITE = {source: uri for uri, source in INCLUDED.items()} | {"README.md": "index.md"}

ALL_HOW_TO = "*howto"
"""Stands in the navigation for all how-to pages."""

_BLOCK = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[([^\]]+)\]\((?!https?:|mailto:|#|<)([^)\s#]+)(#[^)\s]*)?\)")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """List the how-to pages in the navigation by their files."""
    pages = sorted(path.name for path in (ROOT / "docs/howto").glob("*.md"))
    for each in config.nav or []:
        if "How-to" in each:
            at = each["How-to"].index(ALL_HOW_TO)
            each["How-to"][at : at + 1] = [f"howto/{name}" for name in pages if name != "index.md"]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the documents beside the code."""
    for uri, source in INCLUDED.items():
        beside = files.get_file_from_path(source.removeprefix("docs/"))
        if beside is not None:
            files.remove(beside)
        files.append(File.generated(config, uri, abs_src_path=str(ROOT / source)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn links by the tree into links of the site; those to code become plain text."""
    here = page.file.src_uri
    source = INCLUDED.get(here, f"docs/{here}")

    def resolved(link: re.Match[str]) -> str:
        text, path, anchor = link[1], link[2], link[3] or ""
        target = normpath(f"{Path(source).parent.as_posix()}/{path}")
        if not (ROOT / target).exists():
            raise PluginError(f"{source}: links to {path}, which does not exist")
        uri = ON_SITE.get(target, target.removeprefix("docs/"))
        if files.get_file_from_path(uri) is None:
            return text
        return f"[{text}]({relpath(uri, Path(here).parent.as_posix() or '.')}{anchor})"

    parts = _BLOCK.split(markdown)
    parts[::2] = [_LINK.sub(resolved, part) for part in parts[::2]]
    return "".join(parts)
