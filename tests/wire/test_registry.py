"""The topic registry: its file, its errors and its digest."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import RegistryError
from sdrlinkd.wire import Registry, RegistryDigest, Topic, make_registry, parse_registry
from tests.laws import law
from tests.wire.vectors import TABLE_4

PAIRS = [tuple(line.split(",")) for line in TABLE_4.csv.splitlines()]


def changed(topic_id, pair):
    return [*PAIRS[:topic_id], pair, *PAIRS[topic_id + 1 :]]


def numbered(count):
    return "".join(f"topic_{i},pkg/Type{i}\n" for i in range(count))


@pytest.mark.parametrize(
    "text",
    [
        "scan,sensor_msgs/LaserScan\nodom,nav_msgs/Odometry\n",
        "scan,sensor_msgs/LaserScan\nodom,nav_msgs/Odometry",
        "scan,sensor_msgs/LaserScan\r\nodom,nav_msgs/Odometry\r\n",
        "/scan,sensor_msgs/msg/LaserScan\n/odom,nav_msgs/msg/Odometry\n",
        "name,type\nscan,sensor_msgs/LaserScan\nodom,nav_msgs/Odometry\n",
        "name, type\n scan , sensor_msgs/LaserScan\t\n  odom,nav_msgs/Odometry\n",
        "Topic, Type\nscan,sensor_msgs/LaserScan\nodom,nav_msgs/Odometry\n",
        "\ufeff TOPIC\t,type \nscan,sensor_msgs/LaserScan\nodom,nav_msgs/Odometry\n",
        "# laser\n\nscan,sensor_msgs/LaserScan # front\n\n   \n#x,y\nodom,nav_msgs/Odometry#",
    ],
)
def test_forms_of_the_same_file(text):
    assert parse_registry(text).topics == (
        Topic(0, "scan", "sensor_msgs/msg/LaserScan"),
        Topic(1, "odom", "nav_msgs/msg/Odometry"),
    )


def test_file_and_pairs_are_the_same():
    assert make_registry(PAIRS).topics == parse_registry(TABLE_4.csv).topics


def test_look_up():
    registry = parse_registry(TABLE_4.csv)
    assert len(registry) == 6
    assert registry.by_id(3) == registry.by_name("cmd_vel") == registry.by_name("/cmd_vel")
    assert registry.by_id(6) is None
    assert registry.by_id(15) is None
    assert registry.by_name("cmd") is None
    assert "did you mean odom?" in registry.suggest("/odmo")
    assert "scan, odom, imu" in registry.suggest("zzz")


@pytest.mark.parametrize(("count", "has_control"), [(1, True), (15, True), (16, False)])
def test_up_to_sixteen_topics(count, has_control):
    registry = parse_registry(numbered(count))
    assert [topic.id for topic in registry.topics] == list(range(count))
    assert registry.has_control is has_control


def test_seventeen_topics():
    with pytest.raises(RegistryError, match=r"^robots\.csv: 17 topics.* 16"):
        parse_registry(numbered(17), "robots.csv")


@pytest.mark.parametrize("text", ["", "\n\n", "# nothing\n", "name,type\n", "Topic,Type\n"])
def test_no_topics(text):
    with pytest.raises(RegistryError, match=r"^robots\.csv: no topics"):
        parse_registry(text, "robots.csv")


@pytest.mark.parametrize(
    ("line", "match"),
    [
        ("odom", "a line is `name,type`"),
        ("odom,nav_msgs/Odometry,10", "a line is `name,type`"),
        (",nav_msgs/Odometry", "topic name ''"),
        ("/,nav_msgs/Odometry", "topic name '/'"),
        ("//odom,nav_msgs/Odometry", "topic name '//odom'"),
        ("odom/,nav_msgs/Odometry", "topic name 'odom/'"),
        ("a//b,nav_msgs/Odometry", "topic name 'a//b'"),
        ("2d_map,nav_msgs/Odometry", "topic name '2d_map'"),
        ("a/2,nav_msgs/Odometry", "topic name 'a/2'"),
        ("my odom,nav_msgs/Odometry", "topic name 'my odom'"),
        ("odom-1,nav_msgs/Odometry", "topic name 'odom-1'"),
        ("odöm,nav_msgs/Odometry", "topic name 'odöm'"),
        ("odom,", "type ''"),
        ("odom,Odometry", "type 'Odometry'"),
        ("odom,nav_msgs/srv/Odometry", "type 'nav_msgs/srv/Odometry'"),
        ("odom,nav_msgs/msg/", "type 'nav_msgs/msg/'"),
        ("odom,nav_msgs/msg/a/b", "type 'nav_msgs/msg/a/b'"),
        ("odom,nav_msgs.msg.Odometry", "type 'nav_msgs.msg.Odometry'"),
        ("odom,nav_msgs/Odömetry", "type 'nav_msgs/Odömetry'"),
        ("name,type", "type 'type'"),
        ("Topic,Type", "type 'Type'"),
        ("scan,nav_msgs/Odometry", r"scan is listed twice, first at robots\.csv:2"),
        ("/scan,sensor_msgs/LaserScan", r"scan is listed twice, first at robots\.csv:2"),
    ],
)
def test_errors_cite_file_and_line(line, match):
    text = f"# laser\nscan,sensor_msgs/LaserScan\n\n{line}\nimu,sensor_msgs/Imu\n"
    with pytest.raises(RegistryError, match=rf"^robots\.csv:4: .*{match}"):
        parse_registry(text, "robots.csv")


def test_pairs_give_the_same_errors():
    with pytest.raises(RegistryError, match=r"^sdrlinkd\.toml: topic name '2d'"):
        make_registry([("2d", "a/B")], "sdrlinkd.toml")
    with pytest.raises(RegistryError, match=r"^sdrlinkd\.toml: topic scan is listed twice"):
        make_registry([("scan", "a/B"), ("/scan", "a/B")], "sdrlinkd.toml")


names = st.from_regex(r"\A/?[A-Za-z_][A-Za-z0-9_]{0,6}(/[A-Za-z_][A-Za-z0-9_]{0,6}){0,2}\Z")
types = st.from_regex(r"\A[A-Za-z][A-Za-z0-9_]{0,6}/(msg/)?[A-Za-z][A-Za-z0-9_]{0,6}\Z")


@pytest.mark.slow
@law()
@given(
    st.lists(
        st.tuples(names, types),
        min_size=1,
        max_size=16,
        unique_by=lambda pair: pair[0].removeprefix("/"),
    )
)
def test_csv_round_trip(pairs):
    registry = make_registry(pairs)
    again = parse_registry(registry.csv())
    assert again.topics == registry.topics
    assert again.digest() == registry.digest()


@law()
@given(st.text())
def test_any_text_is_a_registry_or_an_error(text):
    try:
        registry = parse_registry(text, "robots.csv")
    except RegistryError as error:
        registry = None
        said = str(error)
    assert 1 <= len(registry) <= 16 if registry else said.startswith("robots.csv:")


@pytest.mark.parametrize(
    ("pairs", "ids"),
    [
        (changed(0, ("scan2", "sensor_msgs/LaserScan")), [0]),
        (changed(1, ("odom", "nav_msgs/Path")), [1]),
        (changed(5, ("clock", "rosgraph_msgs2/Clock")), [5]),
        ([*PAIRS[:2], PAIRS[3], PAIRS[2], *PAIRS[4:]], [2, 3]),
        (PAIRS[1:], [0, 1, 2, 3, 4, 5]),
        (PAIRS[:4], [4, 5]),
        ([*PAIRS, ("battery", "sensor_msgs/BatteryState")], [6]),
    ],
    ids=["name", "type", "package", "order", "first_missing", "last_missing", "one_more"],
)
def test_digest_names_the_culprit(pairs, ids):
    ours = make_registry(PAIRS).digest()
    theirs = make_registry(pairs).digest()
    assert ours.overall != theirs.overall
    assert ours.differing_ids(theirs) == ids
    assert theirs.differing_ids(ours) == ids


def test_a_missing_topic_differs_even_from_an_octet_of_zero():
    ours = RegistryDigest(b"shorter.", b"\x01")
    theirs = RegistryDigest(b"longer..", b"\x01\x00")
    assert ours.differing_ids(theirs) == theirs.differing_ids(ours) == [1]


def test_digest_ignores_what_means_the_same():
    ours = make_registry(PAIRS).digest()
    theirs = make_registry([(f"/{name}", kind.replace("/", "/msg/")) for name, kind in PAIRS])
    assert theirs.digest() == ours
    assert ours.differing_ids(theirs.digest()) == []


def test_a_shortened_digest_tells_that_they_differ_and_not_where():
    ours, theirs = (make_registry(pairs).digest() for pairs in (PAIRS, PAIRS[1:]))
    short = theirs.shortened()
    assert (short.overall, short.per_topic) == (theirs.overall, b"")
    assert ours.differing_ids(short) == short.differing_ids(ours) == []
    assert RegistryDigest.from_bytes(ours.overall + ours.per_topic) == ours


def test_the_dictionaries_of_topics_are_in_the_digest():
    registry = make_registry(PAIRS)
    ours, theirs = registry.digest({1: 7, 3: 9}), registry.digest({1: 7, 3: 10})
    assert ours.differing_ids(registry.digest()) == [1, 3]
    assert ours.differing_ids(theirs) == [3]
    assert registry.digest({}) == registry.digest()


@pytest.mark.parametrize(("count", "leaves"), [(13, True), (14, True), (15, False), (16, False)])
def test_up_to_fourteen_topics_leave_a_topic_id_for_declared_ones(count, leaves):
    assert parse_registry(numbered(count)).leaves_numbers is leaves


def test_suggestions_are_for_names_that_look_alike():
    registry = make_registry([("odom", "a/B"), ("camera/image", "a/B")])
    assert registry.suggest("/camera/imag").endswith(
        "odom, camera/image; did you mean camera/image?"
    )
    assert registry.suggest("zzz") == "the registry has odom, camera/image"
    assert Registry(()).suggest("x") == "the registry has no topics"
