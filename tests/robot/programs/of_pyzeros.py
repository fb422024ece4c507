"""A node of pyzeros: of_pyzeros.py ENDPOINT NAME FOLDER. It is what ours.py is."""

import asyncio
import json
import sys

import pyzeros
import zenoh
from pyzeros.builtin_msgs import Attachment
from ros2_pyterfaces.cyclone.all_msgs import JointState, String
from ros2_pyterfaces.cyclone.all_srvs import SetBool


def connected(endpoint):
    """Return a session as rmw_zenoh's; pyzeros takes one, or opens Zenoh's default."""
    config = zenoh.Config()
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("listen/endpoints", json.dumps(["tcp/127.0.0.1:0"]))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


async def each(subscriber, handle):
    async for message in subscriber.listen_reliable():
        await handle(message)


async def main(name):
    joints = pyzeros.Pub(JointState, "/joints")
    seen = pyzeros.Pub(JointState, f"/{name}/seen")
    heard = pyzeros.Pub(String, f"/{name}/heard")

    async def say(message):
        joints.publish(message)

    async def see(message):
        seen.publish(message)

    async def ask(message):
        client = pyzeros.Client(SetBool, message.data)
        await client.wait_for_service()
        response = await client.call_async(SetBool.Request(data=True))
        heard.publish(String(data=f"{response.success} {response.message}"))
        client.close()

    async def serve(responder):
        responder.response.success = responder.request.data
        responder.response.message = f"set by {name}"
        responder.send()

    async with asyncio.TaskGroup() as group:
        for subscriber, handle in (
            (pyzeros.Sub(JointState, f"/{name}/say"), say),
            (pyzeros.Sub(JointState, "/joints"), see),
            (pyzeros.Sub(String, f"/{name}/ask"), ask),
            (pyzeros.Server(SetBool, f"/{name}/set"), serve),
        ):
            group.create_task(each(subscriber, handle))


async def run(endpoint, name):
    with connected(endpoint) as session, pyzeros.auto_context(node=name, zenoh_session=session):
        await main(name)


Attachment().serialize()  # the first time, this compiles for half a minute
asyncio.run(run(*sys.argv[1:3]))
