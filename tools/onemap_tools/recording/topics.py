"""What is recorded, in the order in which it is taken from the bus."""

from __future__ import annotations

from typing import Any

from onemap_shared import keys
from onemap_shared.keys import Topic
from onemap_shared.messages import Heartbeat, MapDigest, SearchView, TextEmbeddings

FRAMES_HELD = 32  # between two updates: 4 s at 8 Hz, 40 MB of images and 70 MB of features
QUEUE = 512  # odometry at 50 Hz for ten seconds

# Answers of services, recorded as if they were published.
DIGESTS = Topic(keys.MAP_DIGEST.key, MapDigest)
VIEWS = Topic(keys.MAP_SEARCH_VIEW.key, SearchView)
EMBEDDINGS = Topic(keys.EMBED_TEXT.key, TextEmbeddings)
FIELDS, FRAMES, REVISIONS = keys.FIELD, keys.ROBOT_RGBD, keys.MAP_REVISION
QUERIES = keys.MAP_QUERIES
POSE_GRAPHS = keys.ROBOT_POSE_GRAPH
IMAGES: tuple[tuple[Topic[Any], int], ...] = ((FRAMES, FRAMES_HELD),)
# A map's revision names the frame that it fused: taken before the features, it is never
# recorded without a frame that was there when it was.
OTHERS: tuple[tuple[Topic[Any], int], ...] = (
    (REVISIONS, QUEUE),
    (FIELDS, FRAMES_HELD),
    (QUERIES, QUEUE),
    (keys.ROBOT_ODOMETRY, QUEUE),
    (POSE_GRAPHS, 1),
    (keys.ROBOT_CMD_VEL, QUEUE),
    (keys.DETECTIONS, QUEUE),
    (keys.SEARCH_STATE, QUEUE),
    (keys.SEARCH_PATH, QUEUE),
    (keys.ALL_HEARTBEATS, QUEUE),
)


def key_of(topic: Topic[Any], message: object) -> str:
    """The key under which a message is recorded: that of its service for a heartbeat."""
    return keys.heartbeat(message.service).key if isinstance(message, Heartbeat) else topic.key
