"""``python -m onemap_tools.docs messages`` (or ``settings``) prints what the site writes of it."""

from __future__ import annotations

import sys

from onemap_tools.docs.reference import messages_reference, settings_page

PAGES = {"messages": messages_reference, "settings": settings_page}

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in PAGES:
        raise SystemExit(f"usage: python -m onemap_tools.docs {'|'.join(PAGES)}")
    print(PAGES[sys.argv[1]](), end="")
