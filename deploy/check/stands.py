"""Listens to the robot's odometry for some seconds: exit code 1 if it moves, 2 if it is not heard.

Run where the bus is configured by the environment: ``python - SECONDS < stands.py``.
"""

import math
import sys
import time

from onemap_shared import keys
from onemap_shared.config import BusConfig, read, section
from onemap_tools.processes.session import temporary_session

MOVED_M = 0.02  # beyond what a standing robot's odometry may show
seconds = float(sys.argv[1])
with temporary_session(section(read(None), "bus", BusConfig), "status", 10.0) as bus:
    odometry = bus.subscribe(keys.ROBOT_ODOMETRY, 1024)
    end_s, poses = time.monotonic() + seconds, []
    while time.monotonic() < end_s:
        if (message := odometry.take(1.0)) is not None:
            poses.append(message.T_map_body[:2, 3])
if len(poses) < seconds:
    print(f"odometry arrived {len(poses)} times in {seconds:.0f} s")
    raise SystemExit(2)
moved_m = max(math.dist(poses[0], pose) for pose in poses)
print(f"moved {moved_m:.3f} m in {seconds:.0f} s, {len(poses)} samples")
raise SystemExit(moved_m > MOVED_M)
