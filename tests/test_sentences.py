"""House rules for every sentence that the product says."""

from __future__ import annotations

import re
from functools import cache

from tests.sentences import WORD, sentences
from tests.structure import ROOT

LONG = 10  # words from which a text that begins as a sentence is one, and no title
# The project's own words for things that have a name in the field, and metaphors.
PRIVATE = re.compile(
    r"\b(quest|pursuit|helm|glow|footing|shun\w*|dead ends?|whoever holds|of then|gone on with)\b",
    re.IGNORECASE,
)


all_said = cache(sentences)  # when asked: every worker imports this file


def breaking(rule: re.Pattern[str]) -> list[str]:
    return [str(said) for said in all_said() if rule.search(said.text)]


def test_the_list_has_the_sentences_of_every_part() -> None:
    said_here = all_said()
    assert len(said_here) > 1000
    parts = {said.file.split("/")[1] if said.file.startswith("services") else said.file[:5]
             for said in said_here}  # fmt: skip
    assert parts >= {"planner", "gateway", "mapper", "perception", "simulator", "ros2"}
    assert parts >= {"clien", "tools", "share"}
    assert any(said.file.endswith(".js") for said in said_here)
    assert any(said.file.endswith(".html") for said in said_here)


def test_no_word_is_private() -> None:
    assert breaking(PRIVATE) == []


def test_spaces_and_signs_stand_where_they_belong() -> None:
    assert breaking(re.compile(r"\S {2,}\S|\s[,;:!?](\s|$)|\.\.(?!\.)(?<!\.\.\.)|[,;]{2}")) == []


def test_a_long_text_that_begins_as_a_sentence_ends_as_one() -> None:
    long = [s for s in all_said() if s.text[:1].isupper() and len(WORD.findall(s.text)) >= LONG]
    assert [str(said) for said in long if not re.search(r"[.?!:…})'\"]$", said.text)] == []


def test_the_page_of_trouble_quotes_what_is_said() -> None:
    page = (ROOT / "docs/trouble.md").read_text(encoding="utf-8")
    quoted = [row.split("|")[1] for row in page.splitlines() if row.startswith("| ")][1:]
    said = "\n".join(each.text for each in sentences(1)).lower()
    parts = [part.strip().lower() for row in quoted for part in re.split(r"\.\.\.|;", row)]
    assert len(quoted) > 20
    assert [part for part in parts if part not in said] == []
