"""Every message that travels between services, as frozen dataclasses.

A message checks itself when it is built, on both sides of the wire, so every
instance is valid. Arrays are read-only for the receiver. Zero-length arrays stand
for what was not requested.

Each message describes its fields under "Attributes", an array beginning with its
shape. These mean the same wherever a message does not say otherwise:

Attributes:
    sequence: number of the camera frame that the content derives from.
    stamp_ns: capture time of that frame, in nanoseconds of the robot's wall clock.
    encoder_id: which encoder and weights made the features; encoders are never mixed.
    text_space: which text embeddings the features can be compared with.
    intrinsics: of the camera, in pixels of the depth image.
    T_map_camera: (4, 4) rigid transform from the camera frame to the map frame.
    revision: counts every change of the map.
    grid: which cells of the world the grids of this message cover.
    search_id: names the search.
"""

from onemap_shared.messages.checks import *
from onemap_shared.messages.details import *
from onemap_shared.messages.map import *
from onemap_shared.messages.objects import *
from onemap_shared.messages.perception import *
from onemap_shared.messages.places import *
from onemap_shared.messages.robot import *
from onemap_shared.messages.search import *
from onemap_shared.messages.similarity import *
