"""The roles that a node can have; options, help and generated code keep this order."""

from __future__ import annotations

from idlc.scaffold.roles.actions import ACTION_CLIENT, ACTION_SERVER
from idlc.scaffold.roles.role import Role
from idlc.scaffold.roles.services import CLIENT, SERVICE
from idlc.scaffold.roles.topics import PUBLISHER, SUBSCRIBER, TIMER

ROLES: tuple[Role, ...] = (
    PUBLISHER,
    SUBSCRIBER,
    SERVICE,
    CLIENT,
    ACTION_SERVER,
    ACTION_CLIENT,
    TIMER,
)
