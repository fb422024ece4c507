"""The roles that a node can have; options, help and generated code keep this order."""

from __future__ import annotations

from idlc.scaffold.roles.action_client import ACTION_CLIENT
from idlc.scaffold.roles.action_server import ACTION_SERVER
from idlc.scaffold.roles.client import CLIENT
from idlc.scaffold.roles.publisher import PUBLISHER
from idlc.scaffold.roles.role import Role
from idlc.scaffold.roles.service import SERVICE
from idlc.scaffold.roles.subscriber import SUBSCRIBER
from idlc.scaffold.roles.timer import TIMER

ROLES: tuple[Role, ...] = (
    PUBLISHER,
    SUBSCRIBER,
    SERVICE,
    CLIENT,
    ACTION_SERVER,
    ACTION_CLIENT,
    TIMER,
)
