"""Lifecycle nodes: states, transitions and events, as rclpy 7.1.6 had them in the same program."""

import pytest

import idlc
from idlc.robot.lifecycle import LifecycleNode, SimpleManagedEntity, TransitionCallbackReturn
from tests.robot.nodes import String, node_at, spin_until
from tests.support.domains import held_domain

SUCCESS, FAILURE, ERROR = TransitionCallbackReturn
MESSAGES = idlc.load("lifecycle_msgs").lifecycle_msgs
#: A request (a number or a label), what the callbacks return or raise, whether the request
#: succeeds, the state after it, and whether the publisher is active then.
STEPS = [
    (3, [], False, "unconfigured", False),  # no such transition begins here
    (1, [FAILURE], False, "unconfigured", False),
    (1, [], True, "inactive", False),
    ("activate", [], True, "active", True),
    (4, [FAILURE], False, "active", True),
    ("deactivate", [], True, "inactive", False),
    (2, [FAILURE], False, "inactive", False),
    (3, [ValueError("x"), SUCCESS], False, "unconfigured", False),
    ("configure", [], True, "inactive", False),
    (3, ["no outcome", SUCCESS], False, "unconfigured", False),
    (1, [], True, "inactive", False),
    (3, [], True, "active", True),
    (4, [ERROR, FAILURE], False, "finalized", True),  # as in rclpy
    (255, [], False, "finalized", True),
    ("nonsense", [], False, "finalized", True),
]
NUMBERS = [1, 10, 11, 12, 2, 20, 21, 22, 3, 30, 31, 32, 4, 40, 41, 42, 5, 6, 7]
NUMBERS += [50, 51, 52, 60, 61, 62]
PASSING = ["configuring", "configuring", "activating", "deactivating", "deactivating"]
PASSING += ["cleaningup", "activating", "errorprocessing", "configuring", "activating"]
PASSING += ["errorprocessing", "configuring", "activating", "deactivating", "errorprocessing"]


class Planned(LifecycleNode):
    """Does in its callbacks what the test plans; counts what arrives."""

    def __init__(self, name, **options):
        super().__init__(name, **options)
        self.plan, self.befores = [], []
        self.publisher = self.create_lifecycle_publisher(String, "words", 10)

    def _step(self, name, state):
        self.befores.append((name, *state))
        outcome = self.plan.pop(0) if self.plan else getattr(super(), name)(state)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome


for _name in ("configure", "activate", "deactivate", "cleanup", "shutdown", "error"):
    setattr(Planned, f"on_{_name}", lambda self, state, n=f"on_{_name}": self._step(n, state))


def test_requests_change_the_state(address):
    events, words = [], []
    with node_at(address, "asker") as asker:
        node = Planned("keeper", session=asker.session)
        asker.executor.add_node(node)
        asker.create_subscription(
            MESSAGES.msg.TransitionEvent, "/keeper/transition_event", events.append, 100
        )
        listener = asker.create_subscription(String, "words", words.append, 10)
        spin_until(listener.get_publisher_count, asker)

        def call(name, **fields):
            kind = getattr(MESSAGES.srv, "".join(map(str.title, name.split("_"))), None)
            kind = kind or MESSAGES.srv.GetAvailableTransitions
            client = asker.create_client(kind, f"/keeper/{name}")
            spin_until(client.service_is_ready, asker)
            future = client.call_async(kind.Request(**fields))
            spin_until(future.done, asker)
            return future.result()

        for word, plan, succeeds, state, is_active in STEPS:
            part = {"label": word} if isinstance(word, str) else {"id": word}
            node.plan[:] = plan
            transition = MESSAGES.msg.Transition(**part)
            assert call("change_state", transition=transition).success is succeeds, word
            current = call("get_state").current_state
            assert (current.label, node.publisher.is_activated) == (state, is_active), word
            node.publisher.publish(String(data=state))
        assert node.befores[-2:] == [("on_deactivate", "active", 3), ("on_error", "active", 3)]
        # each begins where the last one ended
        states = ["unconfigured", *(event.goal_state.label for event in events)]
        assert [event.start_state.label for event in events] == states[:-1]
        assert [label for label in states if label in PASSING] == PASSING
        assert {(event.timestamp, event.transition.id) for event in events} == {(0, 0)}
        spin_until(lambda: len(words) == 5, asker)
        assert [word.data for word in words] == ["active", "active", "active", *["finalized"] * 2]
        ids = [state.id for state in call("get_available_states").available_states]
        assert ids == [*range(5), *range(10, 16)]
        graph = call("get_transition_graph").available_transitions
        assert [each.transition.id for each in graph] == NUMBERS
        assert not call("get_available_transitions").available_transitions
        node.destroy_node()


class Lamp(SimpleManagedEntity):
    """An entity that counts what it did."""

    flashes = 0

    @SimpleManagedEntity.when_enabled
    def flash(self):
        self.flashes += 1

    def on_cleanup(self, _state):
        return FAILURE


def test_triggers_and_entities_need_no_services():
    with held_domain() as domain, node_at(f"dds:{domain}", "other") as other:
        node = LifecycleNode("quiet", session=other.session, enable_communication_interface=False)
        assert not [each for each in other.graph.entities() if "transition" in each.name]
        lamp = Lamp()
        node.add_managed_entity(lamp)
        with pytest.raises(TypeError, match="not a ManagedEntity"):
            node.add_managed_entity(object())
        with pytest.raises(RuntimeError, match=r"`activate` begins in .*unconfigured"):
            node.trigger_activate()
        lamp.flash()
        assert node.trigger_configure() is node.trigger_activate() is SUCCESS
        lamp.flash()
        assert lamp.flashes == 1
        assert (node.trigger_deactivate(), node.trigger_cleanup()) == (SUCCESS, FAILURE)
        assert node.trigger_shutdown() is SUCCESS
        with pytest.raises(RuntimeError, match="finalized"):
            node.trigger_shutdown()
        node.destroy_node()
