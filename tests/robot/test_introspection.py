"""Service introspection: events of services and clients of idlc.robot."""

from idlc.robot import QoSProfile
from idlc.robot.keys import EntityKind
from idlc.robot.nodes.services import ServiceIntrospectionState as State
from tests.robot.nodes import SetBool, node_at, spin_until

TOPIC = "/set/_service_event"


def serve(request, response):
    response.success = request.data
    return response


def test_events_show_what_each_end_wants(address):
    with node_at(address, "server") as server, node_at(address, "client") as other:
        service = server.create_service(SetBool, "set", serve)
        client = other.create_client(SetBool, "set")
        events = []
        other.create_subscription(SetBool.Event, TOPIC, events.append, 10)
        count = other.graph.count

        def configure(of_service, of_client):
            for end, state in ((service, of_service), (client, of_client)):
                end.configure_introspection(end.node.get_clock(), QoSProfile(depth=10), state)
            publishers = (of_service is not State.OFF) + (of_client is not State.OFF)
            spin_until(lambda: count(EntityKind.PUBLISHER, TOPIC) == publishers, other)
            return publishers

        def called(publishers):
            """Return the types, numbers and contents of the events of a call."""
            events.clear()
            future = client.call_async(SetBool.Request(data=True))
            spin_until(lambda: future.done() and len(events) == 2 * publishers, server, other)
            assert all(event.info.stamp.sec > 10**9 for event in events)
            return sorted(
                (each.info.event_type, each.info.sequence_number, each.request, each.response)
                for each in events
            )

        request, response = [SetBool.Request(data=True)], [SetBool.Response(success=True)]
        spin_until(client.service_is_ready, other)
        publishers = configure(State.CONTENTS, State.METADATA)
        spin_until(lambda: service._introspection[0].get_subscription_count(), server)
        assert called(publishers) == [
            (0, 1, [], []),
            (1, 1, request, []),
            (2, 1, [], response),
            (3, 1, [], []),
        ]
        assert called(configure(State.OFF, State.CONTENTS)) == [
            (0, 2, request, []),
            (3, 2, [], response),
        ]
        assert called(configure(State.OFF, State.OFF)) == []
        configure(State.METADATA, State.METADATA)
        server.destroy_service(service)
        other.destroy_client(client)
        spin_until(lambda: not count(EntityKind.PUBLISHER, TOPIC), other)
