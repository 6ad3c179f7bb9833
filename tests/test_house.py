"""Rules of this project that no linter checks."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import backends
import phy
import sdrlinkd
from benchmarks.structure import deep_chains, graph, trace, writes
from sdrlinkd.link import RX_PDU_REASONS, RX_REASONS, TX_REASONS

ROOT = Path(__file__).parents[1]
LONGEST = 300
LONGER = {
    "sdrlinkd/link/link.py": "the link's whole face: many questions, a line or two each",
    "sdrlinkd/link/transmit/scheduler.py": "one decision from the opportunity to the burst",
    "sdrlinkd/wire/__init__.py": "a door with many names, and a line or two for each",
    "sdrlinkd/reports.py": "the reference of the snapshot: a docstring for every field",
}
"""Files that may be longer, and why."""


def sources(*folders):
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def test_phy_and_backends_are_ours():
    """Other projects have packages of these names, too."""
    home = Path(sdrlinkd.__file__).parents[1]
    assert Path(phy.__file__).parents[1] == home
    assert Path(backends.__file__).parents[1] == home


def test_no_source_file_is_longer_than_a_room():
    long = {
        str(path.relative_to(ROOT))
        for path in sources("sdrlinkd", "backends", "phy", "benchmarks", "ros")
        if len(path.read_text().splitlines()) > LONGEST
    }
    assert long == set(LONGER)


def test_the_bus_document_names_every_reason():
    text = (ROOT / "sdrlinkd/bus/README.md").read_text()
    for reason in (*TX_REASONS, *RX_PDU_REASONS, *RX_REASONS):
        assert f"`{reason}`" in text, reason


def test_every_reason_in_the_code_has_a_name_in_the_table():
    known = {*TX_REASONS, *RX_PDU_REASONS, *RX_REASONS}
    used = set()
    for path in sources("sdrlinkd"):
        used |= set(re.findall(r'"((?:tx|rx)_[a-z_]+)"', path.read_text()))
    assert used - known <= {"rx_format", "rx_depth", "tx_balance"}


def test_constraints_hold_exact_versions_and_no_addresses():
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = [line for line in lines if line and not line.startswith("#")]
    assert pins
    for line in pins:
        assert re.fullmatch(r"[A-Za-z0-9_.\-]+==[A-Za-z0-9_.+!\-]+", line), line


def test_every_dependency_is_pinned():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"].values()
    wanted = [*project["dependencies"], *(name for names in extras for name in names)]
    pinned = (ROOT / "constraints.txt").read_text().lower()
    for requirement in wanted:
        name = re.match(r"[A-Za-z0-9_.\-]+", requirement)[0].lower()
        assert f"\n{name}==" in pinned, name


def test_the_client_imports_nothing_but_zmq():
    code = (
        "import sys; before = set(sys.modules); import sdrlinkd.client;"
        "print(*{m.split('.')[0] for m in sys.modules})"
    )

    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    for heavy in ("msgspec", "numpy", "rosbags", "typer", "rich", "uvloop"):
        assert heavy not in loaded.stdout.split()


def test_the_readme_shows_what_the_documents_are_called():
    text = (ROOT / "README.md").read_text()
    for link in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (ROOT / link).exists(), link


def test_one_burst_is_decided_in_few_calls_and_files():
    steps = {step.name: step for step in trace(with_beacon=False)}
    decided = steps["next_burst"].files
    assert (len(decided), len(set(decided))) <= (50, 12)


def test_a_queued_messages_fields_are_written_by_itself_alone():
    assert not writes("sdrlinkd.link", "Outgoing")


def test_rooms_of_the_link_import_down_and_reach_into_nobody():
    found = graph("sdrlinkd.link")
    assert (len(found.rooms), found.upward) == (19, [])
    chains, lines = deep_chains("sdrlinkd.link")
    assert 1000 * chains / lines < 3


def test_no_test_names_what_is_private():
    """In an import, or as text for `setattr` and its like; ruff (SLF001) finds the attributes."""
    may = re.compile(r"""(?:import|^ ) .*\b_[a-z]\w*,?$|["'.]_[a-z]\w*["']""", re.MULTILINE)
    private, found = re.compile(r"(?:^|\.)_[a-z]\w*$"), []
    for path in sources("tests"):
        # To read the text is quicker than to parse it.
        tree = ast.parse(text) if may.search(text := path.read_text()) else ast.Module([], [])
        for node in ast.walk(tree):
            names = []
            if isinstance(node, ast.ImportFrom):
                names = [each.name for each in node.names]
            elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("attr"):
                names = [each.value for each in node.args if isinstance(each, ast.Constant)]
            found += [(str(path), node.lineno, name) for name in names if private.search(f"{name}")]
    assert found == []


def test_tests_of_the_link_enter_by_a_door():
    """So the inside of a package can change without them."""
    inside = re.compile(r"^\s*(?:from|import) sdrlinkd\.link\.\w+\.\w+", re.MULTILINE)
    past = [path for path in sources("tests", "benchmarks") if inside.search(path.read_text())]
    assert past == []
