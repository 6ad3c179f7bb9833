"""Pages that are made from the code are those that the code makes."""

import re

import msgspec
import pytest
from msgspec import inspect

from benchmarks import page as benchmarks_page
from benchmarks.kept import kept
from sdrlinkd.__main__ import make_parser
from sdrlinkd.cli.app import run
from sdrlinkd.config import Config
from sdrlinkd.link import RX_PDU_REASONS, RX_REASONS, TX_REASONS
from sdrlinkd.manual import field_texts, find_key, key_names, sections
from sdrlinkd.reports import Snapshot
from tests.docs.pages import ROOT
from tests.machine import lacks

DOCS = ROOT / "docs"
MAKE = "`make reference` writes it anew"


def structs_below(kind, found=()):
    """All structs that a type is made of."""
    if isinstance(kind, inspect.StructType) and kind.cls not in found:
        found = (*found, kind.cls)
        for field in kind.fields:
            found = structs_below(field.type, found)
    for part in (getattr(kind, name, None) for name in ("item_type", "value_type")):
        if part is not None:
            found = structs_below(part, found)
    for part in getattr(kind, "types", ()):
        found = structs_below(part, found)
    return found


@pytest.mark.parametrize("root", [Config, Snapshot])
def test_every_field_says_what_it_is(root):
    found = structs_below(inspect.type_info(root))
    assert len(found) > 8
    for struct in found:
        texts = field_texts(struct)
        for field in inspect.type_info(struct).fields:
            own = structs_below(field.type)
            assert field.name in texts or own, f"{struct.__name__}.{field.name}"


@pytest.mark.slow
def test_reference_and_man_pages_are_those_of_the_code():
    pypandoc = pytest.importorskip("pypandoc", reason=lacks("pandoc"))
    assert pypandoc
    from docs.site import reference

    made = reference.pages()
    for name, text in made.items():
        assert (DOCS / "reference" / f"{name}.md").read_text() == text, f"{name}: {MAKE}"
    for name, (page, _) in reference.MAN_PAGES.items():
        text = (DOCS / "reference" / f"{page}.md").read_text()
        assert (DOCS / "man" / name).read_text() == reference.man_page(name, text), MAKE


def test_the_page_of_the_daemon_has_all_its_options():
    text = (DOCS / "reference/sdrlinkd.md").read_text()
    for option in re.findall(r"--[a-z-]+", make_parser().format_help()):
        assert option == "--help" or option in text, option


def test_the_page_of_benchmarks_is_that_of_what_is_kept():
    assert benchmarks_page.PAGE.read_text() == benchmarks_page.page(), "`make figures` writes it"


@pytest.mark.long
def test_pictures_are_drawn_of_what_is_kept(tmp_path, monkeypatch):
    for module in ("latency.pictures", "pound.pictures", "timesync.pictures", "phy_curves"):
        monkeypatch.setattr(f"benchmarks.{module}.FIGURES", tmp_path)
    assert {"pound", "timesync", "phy_curves"} <= set(benchmarks_page.draw())
    drawn = {path.name for path in tmp_path.iterdir()}
    shown = {name for names in benchmarks_page.PICTURES.values() for name in names}
    assert len(drawn) >= 5
    assert drawn <= shown
    assert all((DOCS / "figures" / name).exists() for name in shown)


def test_a_key_is_found_by_its_path_and_by_its_name_alone():
    assert find_key("link.pdu_size").allowed == "a whole number from 32 to 2047"
    assert find_key("pdu_size") == find_key("link.pdu_size")
    assert find_key("rate_hz") == find_key("modem.rate_hz")
    assert find_key("delay_s") is None
    assert len(set(key_names())) == len(key_names()) > 150
    assert {section.name for section in sections()} >= {"", "link", "classes.urgent", "topic.NAME"}


def printed(capsys, *words):
    assert run(["help", *words]) == 0
    return " ".join(capsys.readouterr().out.split())


@pytest.mark.slow
def test_help_shows_keys_sections_pages_names_and_commands(capsys):
    assert "late-joiners" in printed(capsys)
    assert 'Takes one of "auction", "auto"' in printed(capsys, "access.policy")
    assert "relay.routes" in printed(capsys, "relay")
    assert "durability" in printed(capsys, "late-joiners")
    assert "--rate" in printed(capsys, "bag", "play")
    for name, text in {**TX_REASONS, **RX_PDU_REASONS, **RX_REASONS}.items():
        assert " ".join(text.split()) in printed(capsys, name)


def test_help_suggests_what_may_be_meant(capsys):
    assert run(["help", "late-joyners"]) == 2
    assert "did you mean late-joiners?" in capsys.readouterr().err


def test_texts_of_a_struct_include_those_of_its_bases():
    class Base(msgspec.Struct):
        one: int = 1
        """The first."""

    class Derived(Base):
        two: int = 2
        """The
        second."""
        three: int = 3

    assert field_texts(Derived) == {"one": "The first.", "two": "The second."}


def test_the_readme_compares_with_figures_that_are_kept():
    """Its columns: ours in simulated time, ours in real time, and three others."""
    rows = {row["name"]: row for row in kept("pound")["rows"]}
    others = ("nimbro_udp_tcp", "zenoh_block", "fastdds_reliable")
    text = (ROOT / "README.md").read_text()
    for title, name in (
        ("laser, mean delay", "laser_2n_D_ms"),
        ("its standard deviation", "laser_2n_stdD_ms"),
        ("image, mean delay", "image_2n_D_ms"),
        ("fresh scans after an outage of 5 s", "recovery_after_5s_outage_s"),
    ):
        told = re.search(rf"^\| {title} \|(.*)\|$", text, re.MULTILINE)[1].split("|")[:5]
        row, real = rows[name], rows[f"{name}_rt"]
        measured = [row["value"], real["peers"].get("two daemons and a hub", real["value"])]
        measured += [row["peers"][other] for other in others]
        for cell, value in zip(told, measured, strict=True):
            number = cell.split()[0]
            decimals = len(number.partition(".")[2])
            assert float(number) == pytest.approx(value, abs=0.51 * 10**-decimals), (title, cell)
