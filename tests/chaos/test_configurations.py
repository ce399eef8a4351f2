"""Mutated configurations: each is used or refused with a sentence, whatever it holds."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from pydantic import BaseModel

from onemap_shared.config import ConfigError, read, section
from tests.chaos.report import Attack
from tests.chaos.test_wire import mutated

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

FILES = 500
SEED = 11
FOLDER = Path(__file__).parents[2] / "deploy" / "config"
VALUES: tuple[Any, ...] = (
    *("", "x", "\x00", "\ud83d", "a" * 10_000, "2001-99-99", "0x", "tcp/", "../..", "nan"),
    *(None, True, 0, -1, 1, 2**63, 10**400, 1e308, -1e-320, float("nan"), float("inf")),
    *([], {}, [[]], [None], {"": {}}, {1: 2}, [1, "a"], {"a": [{"b": None}]}),
)
TEXTS: tuple[bytes, ...] = (
    b"2001-13-45",
    b"1:99:99",
    b"&a [*a]",
    b"!!python/object:os.system x",
    b"? [a]: b\n",
)
TEXTS += (
    b"[" * 4000,
    b"{a: " * 2000,
    b"- " * 3000,
    b"0b",
    b"1_0",
    b"!!int x",
    b"!!binary %",
    b"<<:",
)


@cache
def models() -> Mapping[str, type[BaseModel]]:
    """The models of all sections; they bring every service's packages, so not at import."""
    from onemap_tools.cli.config_report import installed_models

    return installed_models().known


def with_other_value(document: dict[str, Any], rng: random.Random) -> bytes:
    """One to three settings of any section get another value; some are of another section."""
    changed = {name: dict(values or {}) for name, values in document.items()}
    for _ in range(rng.randint(1, 3)):
        name = rng.choice(list(models()))
        field = rng.choice(list(models()[name].model_fields))
        changed.setdefault(name, {})[field] = rng.choice(VALUES)
    return yaml.safe_dump(changed, allow_unicode=True).encode("utf-8", "surrogatepass")


def attacked(text: bytes, rng: random.Random) -> bytes:
    """A configuration with some mutations, of its bytes or of its values."""
    kind = rng.randrange(3)
    if kind == 0:
        return mutated(text, rng)
    if kind == 1:
        lines = text.splitlines(keepends=True)
        at = rng.randrange(len(lines))
        return b"".join([*lines[:at], rng.choice((b"a: ", b"")) + rng.choice(TEXTS), *lines[at:]])
    return with_other_value(yaml.safe_load(text), rng)


def outcome(path: Path) -> str:
    """What every service does with this file."""
    try:
        sections = read(path, {})
    except ConfigError:
        return "refused"
    except Exception as problem:
        return type(problem).__name__
    refused = False
    for name, model in models().items():
        try:
            section(sections, name, model)
        except ConfigError:
            refused = True
        except Exception as problem:
            return f"{name}: {type(problem).__name__}"
    return "refused" if refused else "accepted"


def test_mutated_configurations(attack: Attack, tmp_path: Path) -> None:
    texts = [path.read_bytes() for path in sorted(FOLDER.glob("*.yaml"))]
    outcomes, rng, path = Counter[str](), random.Random(SEED), tmp_path / "attacked.yaml"
    count = attack.attempts(FILES)
    for _ in range(count):
        path.write_bytes(attacked(rng.choice(texts), rng))
        outcomes[outcome(path)] += 1
    escaped = {name: n for name, n in outcomes.items() if name not in ("accepted", "refused")}
    attack.holds(
        f"{count:,} mutated configurations",
        limit="0 escape as another error",
        measured=f"{outcomes['refused']} refused, {outcomes['accepted']} accepted, "
        f"{sum(escaped.values())} escaped {escaped or ''}".strip(),
        held=not escaped,
    )
