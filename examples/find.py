"""Ask where something is, then let the robot find it.

python examples/find.py sofa [http://127.0.0.1:8080]
"""

from __future__ import annotations

import sys

from onemap import Client, OneMapError


def main(name: str, url: str = "http://127.0.0.1:8080") -> int:
    """0 only if ``name`` was found; a refusal is one sentence that says what to do."""
    try:
        return find(name, url)
    except OneMapError as error:
        print(error, file=sys.stderr)
        return 1


def find(name: str, url: str) -> int:
    """Print where ``name`` may be, then follow a search for it."""
    with Client(url) as client:
        for region in client.query(name).regions:
            x_m, y_m = region.centre_m
            print(f"maybe at ({x_m:.2f}, {y_m:.2f}) m, score {region.score:.2f}")
        search = client.search(name)
        for event in search.events():
            print(event)
        for result in search.latest.results:
            print(f"{result.name}: {result.outcome} at {result.position_m}")
        return 0 if search.latest.all_found else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
