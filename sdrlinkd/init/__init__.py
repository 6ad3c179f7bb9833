"""Makes the first configurations and registry of a new team, as text."""

from sdrlinkd.init.choosing import MOST_TOPICS, Choice, FoundTopic, choose, named
from sdrlinkd.init.copying import copy_of, dictionaries_of
from sdrlinkd.init.graph import topics_of_graph
from sdrlinkd.init.radios import RADIOS, RadioPreset
from sdrlinkd.init.team import KEYS, REGISTRY, Team, team_files

__all__ = [
    "KEYS",
    "MOST_TOPICS",
    "RADIOS",
    "REGISTRY",
    "Choice",
    "FoundTopic",
    "RadioPreset",
    "Team",
    "choose",
    "copy_of",
    "dictionaries_of",
    "named",
    "team_files",
    "topics_of_graph",
]
