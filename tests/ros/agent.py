"""A ROS 2 program that tests drive over its standard input: one JSON command a line, one answer.

Runs in a Python that has rclpy. Messages are filled with values that follow from a number, so that
both ends know what must arrive.
"""

import hashlib
import importlib
import json
import os
import re
import sys
import threading
import time
from random import Random

import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sdrlink_ros.kinds import kind

INTEGERS = {"int8": 7, "uint8": 8, "int16": 15, "uint16": 16, "int32": 31, "uint32": 32,
            "int64": 63, "uint64": 64, "octet": 8, "byte": 8, "char": 8}  # fmt: skip


def filled(message, rng):
    """`message` with all fields set."""
    for name, text in message.get_fields_and_field_types().items():
        setattr(message, name, value(text, getattr(message, name), rng))
    return message


def value(text, old, rng):
    if hasattr(old, "get_fields_and_field_types"):
        return filled(old, rng)
    if text in INTEGERS:
        number = rng.randrange(1 << INTEGERS[text])
        return bytes([number]) if text in ("octet", "byte") else number
    if text in ("float", "double"):
        return rng.randrange(-1000, 1000) / 8
    if text == "boolean":
        return rng.random() < 0.5
    if (array := re.fullmatch(r"(.+)\[(\d+)\]", text)) is not None:
        return [value(array[1], None, rng) for _ in range(int(array[2]))]
    if (sequence := re.fullmatch(r"sequence<(.+?)(?:, (\d+))?>", text)) is not None:
        inner, most = sequence[1], int(sequence[2] or 360)
        n = min(most, 2 if "/" in inner else 360)
        values = [value(inner, None, rng) for _ in range(n)]
        return b"".join(values) if inner == "octet" and not most else values
    if (words := re.fullmatch(r"(w?)string(?:<(\d+)>)?", text)) is not None:
        # A wide one has 16 bits for each character.
        told = f"text {rng.randrange(1 << 30)}" + ("\u00fc\u20ac" if words[1] else "")
        return told[: int(words[2] or 100)]
    package, name = text.split("/")
    return filled(kind(f"{package}/msg/{name}").message(), rng)


def plain(item):
    """A message as nested lists of plain values, for comparison."""
    if hasattr(item, "get_fields_and_field_types"):
        return [plain(getattr(item, name)) for name in item.get_fields_and_field_types()]
    if isinstance(item, bytes):
        return list(item)
    if hasattr(item, "tolist"):
        return item.tolist()
    if hasattr(item, "__iter__") and not isinstance(item, str):
        return [plain(each) for each in item]
    return item


def digest(message):
    return hashlib.sha256(json.dumps(plain(message)).encode()).hexdigest()[:16]


def made(type_name, number):
    return filled(kind(type_name).message(), Random(number))


def profile(fields):
    reliability, durability = ReliabilityPolicy, DurabilityPolicy
    return QoSProfile(
        depth=fields.get("depth", 100),
        reliability=reliability.BEST_EFFORT if fields.get("best_effort") else reliability.RELIABLE,
        durability=(durability.TRANSIENT_LOCAL if fields.get("latched") else durability.VOLATILE),
    )


class Agent:
    """A node with whatever publishers and subscriptions the commands ask for."""

    def __init__(self, name):
        self.node = rclpy.create_node(name)
        self.publishers, self.heard, self.senders = {}, {}, []

    def types_of(self, package):
        """The message types of a package."""
        module = importlib.import_module(f"{package}.msg")
        return sorted(f"{package}/msg/{name}" for name in dir(module) if name[0].isupper())

    def pub(self, topic, type, key="", **qos):
        made_ = self.node.create_publisher(kind(type).message, topic, profile(qos))
        self.publishers[topic, key] = made_, type

    def sub(self, topic, type, **qos):
        heard = self.heard[topic] = []
        message = kind(type).message
        self.node.create_subscription(message, topic, heard.append, profile(qos), raw=True)
        self.heard[topic, "type"] = message

    def unpub(self, topic, key=""):
        self.node.destroy_publisher(self.publishers.pop((topic, key))[0])

    def send(self, topic, first=0, n=1, hz=0.0, key=""):
        """Publish messages of the numbers `first` and up, in the background if `hz` is given."""
        publisher, type_ = self.publishers[topic, key]
        messages = [made(type_, first + i) for i in range(n)]

        def send_all():
            begin = time.monotonic()
            for i, message in enumerate(messages):
                if hz:
                    time.sleep(max(0.0, begin + i / hz - time.monotonic()))
                publisher.publish(message)

        if not hz:
            send_all()
            return
        self.senders.append(threading.Thread(target=send_all))
        self.senders[-1].start()

    def raw(self, topic, octets, key=""):
        self.publishers[topic, key][0].publish(bytes.fromhex(octets))

    def sent(self):
        """Wait until everything is sent."""
        for sender in self.senders:
            sender.join()

    def expect(self, type, first, n):
        return [digest(made(type, first + i)) for i in range(n)]

    def got(self, topic):
        message = self.heard[topic, "type"]
        return [digest(deserialize_message(cdr, message)) for cdr in self.heard[topic]]

    def got_raw(self, topic):
        return [cdr.hex() for cdr in self.heard[topic]]

    def count(self, topic):
        return len(self.heard[topic])

    def last(self, topic):
        return plain(deserialize_message(self.heard[topic][-1], self.heard[topic, "type"]))

    # Services and actions.

    def serve(self, name):
        """Serve a SetBool, and count how often each message was seen."""
        from std_srvs.srv import SetBool

        self.served = []

        def answer(request, response):
            self.served.append(request.data)
            response.success = request.data
            response.message = f"call {len(self.served)}"
            return response

        self.server = self.node.create_service(SetBool, name, answer)

    def n_served(self):
        return len(self.served)

    def is_served(self, name):
        """Whether somebody here serves it."""
        return self.node.count_services(name) > 0

    def call(self, name, n, at_once=1, timeout_s=60.0):
        """Call a SetBool `n` times; the messages of the answers, None where none came in time."""
        from std_srvs.srv import SetBool

        client = self.node.create_client(SetBool, name)
        assert client.wait_for_service(timeout_s)
        answers = []
        for begin in range(0, n, at_once):
            numbers = range(begin, min(n, begin + at_once))
            calls = [client.call_async(SetBool.Request(data=i % 2 == 0)) for i in numbers]
            deadline = time.monotonic() + timeout_s
            while not all(each.done() for each in calls) and time.monotonic() < deadline:
                time.sleep(0.005)
            answers += [
                [each.result().success, each.result().message] if each.done() else None
                for each in calls
            ]
        return answers

    def call_later(self, name, n, hz):
        """Call in the background at a steady rate; see `called`."""
        from std_srvs.srv import SetBool

        client = self.node.create_client(SetBool, name)
        assert client.wait_for_service(60.0)
        self.calls = []

        def call_all():
            for i in range(n):
                self.calls.append(client.call_async(SetBool.Request(data=i % 2 == 0)))
                time.sleep(1 / hz)

        self.calling = threading.Thread(target=call_all)
        self.calling.start()

    def called(self, within_s=15.0):
        """The answers of the calls in the background, None where none came."""
        self.calling.join()
        deadline = time.monotonic() + within_s
        while not all(each.done() for each in self.calls) and time.monotonic() < deadline:
            time.sleep(0.01)
        return [
            [each.result().success, each.result().message] if each.done() else None
            for each in self.calls
        ]

    def wait(self, seconds):
        """Do nothing, while others do."""
        time.sleep(seconds)

    def act(self, name, step_s):
        """Serve a Fibonacci action that takes `step_s` for each number."""
        from rclpy.action import ActionServer, CancelResponse
        from rclpy.callback_groups import ReentrantCallbackGroup
        from test_msgs.action import Fibonacci

        self.goals = []

        def execute(goal):
            self.goals.append(goal.request.order)
            numbers = [0, 1]
            while len(numbers) < goal.request.order:
                time.sleep(step_s)
                if goal.is_cancel_requested:
                    goal.canceled()
                    return Fibonacci.Result(sequence=numbers)
                numbers.append(numbers[-1] + numbers[-2])
                goal.publish_feedback(Fibonacci.Feedback(sequence=numbers))
            goal.succeed()
            return Fibonacci.Result(sequence=numbers)

        # A goal can be cancelled while it is executed.
        node = rclpy.create_node(f"{self.node.get_name()}_acting")
        self.action_server = ActionServer(
            node, Fibonacci, name, execute, callback_group=ReentrantCallbackGroup(),
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )  # fmt: skip
        spin(node, MultiThreadedExecutor(4))

    def send_goal(self, name, order):
        """Send a goal, and wait until it is accepted."""
        from rclpy.action import ActionClient
        from test_msgs.action import Fibonacci

        self.feedback = []
        self.action_client = ActionClient(self.node, Fibonacci, name)
        assert self.action_client.wait_for_server(60.0)
        future = self.action_client.send_goal_async(
            Fibonacci.Goal(order=order),
            lambda told: self.feedback.append(len(told.feedback.sequence)),
        )
        while not future.done():
            time.sleep(0.01)
        self.goal = future.result()
        self.result = self.goal.get_result_async()
        return self.goal.accepted

    def n_feedback(self):
        return len(self.feedback)

    def cancel_goal(self):
        self.begin_to_cancel()
        while self.cancelled() is None:
            time.sleep(0.01)
        return self.cancelled()

    def begin_to_cancel(self):
        self.cancelling = self.goal.cancel_goal_async()

    def cancelled(self):
        """How many goals are cancelled by the last request; None without an answer."""
        if not self.cancelling.done():
            return None
        return len(self.cancelling.result().goals_canceling)

    def result_of_goal(self):
        """(status, sequence) of the last goal; None while there is none."""
        if not self.result.done():
            return None
        return [self.result.result().status, list(self.result.result().result.sequence)]

    def n_goals(self):
        return len(self.goals)

    def matched(self, topic, key=""):
        return self.publishers[topic, key][0].get_subscription_count()

    def names(self):
        return dict(self.node.get_topic_names_and_types())

    def publishers_of(self, topic):
        return sorted(each.node_name for each in self.node.get_publishers_info_by_topic(topic))

    def set(self, node, name, value):
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter

        client = self.node.create_client(SetParameters, f"/{node}/set_parameters")
        assert client.wait_for_service(10.0)
        call = client.call_async(
            SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        )
        while not call.done():
            time.sleep(0.01)
        (result,) = call.result().results
        return [result.successful, result.reason]


def spin(node, executor):
    """Have `executor` serve `node` in the background."""
    executor.add_node(node)
    threading.Thread(target=executor.spin, daemon=True).start()


def main():
    rclpy.init()
    agent = Agent(sys.argv[1])
    # A MultiThreadedExecutor can spin so fast that a thread that publishes waits for seconds.
    spin(agent.node, SingleThreadedExecutor())
    for line in sys.stdin:
        verb, arguments = json.loads(line)
        try:
            answer = {"ok": getattr(agent, verb)(**arguments)}
        except Exception as error:  # the test must see it
            answer = {"error": repr(error)}
        print(json.dumps(answer), flush=True)
    # The thread that spins would outlive rclpy.
    os._exit(0)


if __name__ == "__main__":
    main()
