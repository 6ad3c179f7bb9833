"""Rules of this project that no linter checks."""

import ast
import re
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

import backends
import phy
import sdrlinkd
from benchmarks.structure import graph, writes
from sdrlinkd.link import RX_PDU_REASONS, RX_REASONS, TX_REASONS

ROOT = Path(__file__).parents[1]


def sources(*folders):
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def test_phy_and_backends_are_ours():
    """Other projects have packages of these names, too."""
    home = Path(sdrlinkd.__file__).parents[1]
    assert Path(phy.__file__).parents[1] == home
    assert Path(backends.__file__).parents[1] == home


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


@pytest.mark.slow
def test_a_queued_messages_fields_are_written_by_itself_alone():
    assert not writes("sdrlinkd.link", "Outgoing")


@pytest.mark.slow
def test_rooms_of_the_link_import_down():
    assert graph("sdrlinkd.link").upward == []


@pytest.mark.slow
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


DOORS_OF_PHY = {"engine", "kernels", "reference", "testing", "wifi"}


@cache
def used_by_tests():
    """What each file of the tests imports, and what it replaces: (path, full name)."""
    return [(path, name) for path in sources("tests") for name in imported(path)]


def imported(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{each.name}" for each in node.names)
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "setattr":
            yield ast.unparse(node.args[0]).removeprefix("f").strip("'")


def doors():
    """Packages that the product enters by their doors, and the names that each door has."""
    rules = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    protected = {each for rule in rules["contracts"] for each in rule.get("protected_modules", ())}
    packages = {each.removesuffix(".**") for each in protected if each.endswith(".**")}
    for package in (*packages, *(f"phy.{each}" for each in DOORS_OF_PHY)):
        path = ROOT / package.replace(".", "/")
        text = (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text()
        listed = re.search(r"^__all__ = (\[.*?\])", text, re.MULTILINE | re.DOTALL)
        more = DOORS_OF_PHY if package == "phy" else {"testing"}
        yield package, {*ast.literal_eval(listed[1]), *more}


def past(name, names):
    """The package that `name` enters, but by its door (`names`); None: no package."""
    parts = name.split(".")
    for n in range(len(parts), 0, -1):
        if (package := ".".join(parts[:n])) in names:
            return package if parts[n:] and parts[n] not in names[package] else None
    return None


@pytest.mark.slow
def test_tests_enter_by_doors():
    """So the inside of a package can change without them."""
    names = dict(doors())
    assert past("sdrlinkd.link.access.csma.after", names) == "sdrlinkd.link.access"
    assert past("sdrlinkd.link.access.after", names) is None
    assert past("phy.kernels.viterbi.decode_rows", names) == "phy.kernels"
    assert [use for use in used_by_tests() if past(use[1], names)] == []


@pytest.mark.slow
def test_tests_import_from_no_other_test():
    """What several of them need is in a module of its own."""
    ours = [use for use in used_by_tests() if use[1].startswith("tests.")]
    assert [use for use in ours if ".test_" in use[1]] == []
