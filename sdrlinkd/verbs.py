"""The verbs that the control socket answers."""

import logging
from typing import Any

import msgspec

from sdrlinkd import __version__
from sdrlinkd.config import Setup
from sdrlinkd.control import Control, Verb
from sdrlinkd.declaring import Declaring
from sdrlinkd.descriptors import Descriptors
from sdrlinkd.errors import UserError
from sdrlinkd.node import Node
from sdrlinkd.opening import Opening
from sdrlinkd.policies import Policies
from sdrlinkd.reloading import Reloading
from sdrlinkd.reports import ReceivedTopicReport
from sdrlinkd.wire import FIRST_NUMBER

log = logging.getLogger("sdrlinkd")


def make_verbs(
    setup: Setup,
    node: Node,
    control: Control,
    policies: Policies,
    opening: Opening,
    reloading: Reloading,
    declaring: Declaring,
    descriptors: Descriptors,
) -> dict[str, Verb]:
    """The verbs of the control socket by name (bus document, section 5)."""

    def hello(_: dict[str, Any]) -> object:
        return {
            "daemon": "sdrlinkd",
            "version": __version__,
            "node": setup.node_id,
            "verbs": {name: verb.help for name, verb in verbs.items()},
        }

    def status(_: dict[str, Any]) -> object:
        snapshot = node.snapshot(control.requests)
        more = [*declaring.said(), *descriptors.notices()]
        return msgspec.structs.replace(snapshot, notices=[*snapshot.notices, *more])

    def reload_policies(_: dict[str, Any]) -> object:
        told = reloading.reload()
        log.info("re-read on request: %s", told)
        return {"reloaded": told, "unchanged": "all other keys need a restart"}

    def set_policy(arguments: dict[str, Any]) -> object:
        changes = {key: value for key, value in arguments.items() if key != "topic"}
        if not changes:
            raise UserError("set: nothing to change; name at least one key")
        return policies.set(str(arguments.get("topic", "")), changes)

    def policy(arguments: dict[str, Any]) -> object:
        return policies.policy(str(arguments.get("topic", "")))

    def why(arguments: dict[str, Any]) -> object:
        name = str(arguments.get("topic", ""))
        received = node.snapshot(control.requests).link.received
        of_name = [each for each in received if each.republished_as == name]
        if of_name and of_name[0].topic_id >= FIRST_NUMBER:
            # Declared by another robot: its number means nothing here.
            return {"why": [_received(each) for each in of_name]}
        topic_id = of_name[0].topic_id if of_name else policies.topic_id(name)
        own = policies.name(topic_id)
        heard = [_received(each) for each in received if each.name == own]
        return {"why": [*node.why(topic_id, policies.told(topic_id)), *heard]}

    verbs = {
        "hello": Verb(hello, "who answers, and its verbs"),
        "status": Verb(status, "the whole snapshot"),
        "topics": Verb(lambda _: node.snapshot(control.requests).link.topics, "topics sent"),
        "peers": Verb(lambda _: node.snapshot(control.requests).link.neighbors, "robots heard"),
        "config": Verb(lambda _: opening.config, "the configuration in force"),
        "check": Verb(
            lambda _: {"problems": node.audit(), "ledger": node.snapshot(control.requests).link},
            "verify that the ledger adds up",
        ),
        "declare": Verb(
            lambda arguments: declaring.declare(opening.pdu_link.now(), arguments),
            "take a topic from now on, with its type and QoS",
        ),
        "undeclare": Verb(
            declaring.undeclare, "let another type have the name of a topic that was declared"
        ),
        "declared": Verb(lambda _: declaring.declared(), "topics that other robots declared"),
        "rate": Verb(
            lambda arguments: node.wanting.ask(arguments, opening.pdu_link.now()),
            "ask another robot for fewer messages of a topic, for 5 s",
        ),
        "demand": Verb(
            lambda arguments: {
                **declaring.demand(opening.pdu_link.now(), arguments),
                "rated": node.wanting.rated,
            },
            "own topics that consumers at other robots subscribe to",
        ),
        "why": Verb(why, "explain in plain words what happens to a topic"),
        "policy": Verb(policy, "a topic's policy in force"),
        "set": Verb(set_policy, "change a topic's policy", changes=True),
        "reload": Verb(
            reload_policies,
            "re-read the topic policies and, while there is no radio, its settings",
            changes=True,
        ),
    }
    return verbs


def _received(topic: ReceivedTopicReport) -> str:
    """What a robot sent of a topic, in one sentence."""
    words = f"received from robot {topic.src}: {topic.delivered} messages"
    if topic.republished_as:
        words += f" as {topic.republished_as}, {topic.delivered_per_s:.3g} a second now"
    lost = ", ".join(f"{reason} {n}" for reason, n in topic.dropped.items() if n)
    return f"{words}; lost: {lost}" if lost else words
