from __future__ import annotations

import re

import pytest

from onemap_shared import keys
from onemap_shared.keys import Delivery, Procedure, Topic
from onemap_shared.services import SERVICES

TOPICS = [value for value in vars(keys).values() if isinstance(value, Topic)]
PROCEDURES = [value for value in vars(keys).values() if isinstance(value, Procedure)]
KEYS = [topic.key for topic in TOPICS] + [procedure.key for procedure in PROCEDURES]


def test_every_key_belongs_to_one_topic_or_procedure() -> None:
    assert len(KEYS) == len(set(KEYS))


@pytest.mark.parametrize("key", KEYS)
def test_keys_name_a_stage_a_subject_and_a_version(key: str) -> None:
    assert re.fullmatch(r"(robot|perception|map|search|health)/[a-z_*/]+/v1", key)


def test_only_velocity_commands_travel_as_commands() -> None:
    assert [topic for topic in TOPICS if topic.delivery is Delivery.COMMAND] == [keys.ROBOT_CMD_VEL]


def test_a_late_start_of_a_search_moves_no_robot() -> None:
    assert keys.SEARCH_START.stale_after_s is not None


@pytest.mark.parametrize("service", SERVICES)
def test_heartbeats_and_tokens_match_the_wildcards(service: str) -> None:
    heartbeat, token = keys.heartbeat(service).key, keys.liveliness(service, "i1")
    assert re.fullmatch(keys.ALL_HEARTBEATS.key.replace("*", "[^/]+"), heartbeat)
    assert re.fullmatch(keys.ALL_LIVELINESS.replace("*", "[^/]+"), token)
    assert (token.split("/")[-3], token.split("/")[-1]) == (service, "i1")
