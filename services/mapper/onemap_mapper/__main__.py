"""``python -m onemap_mapper``: run the mapper."""

from onemap_mapper.config import MapperConfig
from onemap_mapper.service import build
from onemap_shared.runner import run_service

if __name__ == "__main__":
    raise SystemExit(run_service("mapper", MapperConfig, build))
