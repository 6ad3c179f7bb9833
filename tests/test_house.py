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


def test_tests_of_the_link_enter_by_a_door():
    """So the inside of a package can change without them."""
    inside = re.compile(r"^\s*(?:from|import) sdrlinkd\.link\.\w+\.\w+", re.MULTILINE)
    past = [path for path in sources("tests", "benchmarks") if inside.search(path.read_text())]
    assert past == []


PHY_DOORS = ("phy", "phy.engine", "phy.kernels", "phy.reference", "phy.testing", "phy.wifi")


def offered_by(door):
    """The names in a module's `__all__`; kernels are not imported, as that takes a second."""
    path = ROOT / door.replace(".", "/")
    text = (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text()
    offered = re.search(r"^__all__ = (\[.*?\])", text, re.MULTILINE | re.DOTALL)[1]
    return ast.literal_eval(offered)


def names_in(text, package):
    """What a source names of a package: imported, used, or in a string, such as a program."""
    dotted = rf"(?<![\w./]){package}(?:\.(?!__)[a-z_]\w*)*(?:\.[A-Z]\w*)?"
    imports = rf"from ({dotted}) import (?:\(([^)]*)\)|([\w, ]+))"
    for module, several, one in re.findall(imports, text):
        yield from (f"{module}.{name}" for name in re.findall(r"(\w+)(?: as \w+)?", several or one))
    # Another package may have a module of that name.
    is_imported = re.search(rf"import {package}\b", text)
    yield from re.findall(
        dotted if is_imported else rf"(?<=[\"']){dotted}", re.sub(imports, "", text)
    )


def test_tests_of_phy_enter_by_a_door():
    """So its inside can change without them; `phy.testing` offers them what nobody else needs."""
    offered = {f"{door}.{name}" for door in PHY_DOORS for name in offered_by(door)}
    named = {
        (str(path.relative_to(ROOT)), name)
        for path in sources("tests")
        for name in names_in(path.read_text(), "phy")
    }
    past = {(path, name) for path, name in named if name not in {*PHY_DOORS, *offered}}
    assert past == set()
    assert len(named) > 300
