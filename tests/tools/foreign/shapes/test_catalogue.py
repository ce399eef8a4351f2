"""Every class: eight valid, distinct shapes of the sizes that real ones have."""

from __future__ import annotations

import hashlib
from functools import cache

import numpy as np
import pytest

from onemap_perception.encoders.mini import SHIPPED
from onemap_perception.text.vocabulary import load_vocabulary
from onemap_tools.foreign.finish_picker import LOFT, FinishPicker
from onemap_tools.foreign.shapes.catalogue import CATALOGUE, SHAPES, ForeignPiece, build_piece

MAX_TRIANGLES = 60_000  # of one piece: a room of them must fit in memory and in time


@cache
def piece(category: str, variant: int) -> ForeignPiece:
    """A shape with the same colours each time."""
    return build_piece(category, variant, FinishPicker(np.random.default_rng(variant), LOFT))


def fingerprint(made: ForeignPiece) -> str:
    """Of the geometry and the textures."""
    parts = [(part.mesh.vertices, part.uv, part.finish.texture) for part in made.parts]
    return hashlib.sha256(b"".join(a.tobytes() for part in parts for a in part)).hexdigest()


def test_there_are_enough_classes_and_shapes() -> None:
    assert len(CATALOGUE) >= 20
    assert SHAPES >= 8


def test_most_classes_have_a_word_in_the_vocabulary_of_mini_and_some_have_none() -> None:
    names = load_vocabulary(SHIPPED).names
    assert [name for name in CATALOGUE if name not in names] == ["piano", "ladder", "ironing board"]


@pytest.mark.parametrize("category", CATALOGUE)
def test_shapes_are_valid_and_have_real_sizes(category: str) -> None:
    kind = CATALOGUE[category]
    for variant in range(SHAPES):
        made = piece(category, variant)
        lower, upper = made.bounds
        size = upper - lower
        for axis, limits in enumerate((kind.width_m, kind.depth_m, kind.height_m)):
            assert limits[0] <= size[axis] <= limits[1], f"shape {variant}: {size}"
        np.testing.assert_allclose([lower[2], upper[1], lower[0] + upper[0]], 0, atol=1e-9)
        triangles = 0
        for part in made.parts:
            corners = part.mesh.vertices[part.mesh.faces]
            assert np.isfinite(corners).all()
            assert np.isfinite(part.uv).all()
            assert part.uv.shape == (len(part.mesh.faces), 3, 2)
            triangles += len(corners)
        assert 100 < triangles < MAX_TRIANGLES


def form(made: ForeignPiece) -> tuple[float, ...]:
    """The spread of a piece's points along the axes: alike only for like geometry."""
    points = np.concatenate([part.mesh.vertices for part in made.parts])
    return tuple(points.std(axis=0).round(5).tolist())


@pytest.mark.parametrize("category", [name for name in CATALOGUE if name != "rug"])
def test_shapes_differ_in_form_and_not_in_colour_alone(category: str) -> None:
    assert len({form(piece(category, variant)) for variant in range(SHAPES)}) == SHAPES


def test_rugs_differ_in_form_or_in_pattern() -> None:
    assert len({form(piece("rug", variant)) for variant in range(SHAPES)}) >= SHAPES - 1
    assert len({fingerprint(piece("rug", variant)) for variant in range(SHAPES)}) == SHAPES


@pytest.mark.parametrize("category", ["sofa", "bookcase", "refrigerator", "potted plant"])
def test_a_shape_is_a_function_of_its_seed(category: str) -> None:
    again = build_piece(category, 2, FinishPicker(np.random.default_rng(2), LOFT))
    other = build_piece(category, 2, FinishPicker(np.random.default_rng(3), LOFT))
    assert fingerprint(again) == fingerprint(piece(category, 2))
    assert fingerprint(other) != fingerprint(again)


def test_a_shape_that_does_not_exist_is_an_error() -> None:
    with pytest.raises(ValueError, match="shape 8 of sofa: every class has shapes 0 to 7"):
        build_piece("sofa", 8, FinishPicker(np.random.default_rng(0), LOFT))
