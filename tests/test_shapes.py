"""Wrong shapes are found under test, also where a call of the same form was right before."""

import numpy as np
import pytest
from jaxtyping import Float, TypeCheckError

from opspace.law.hierarchy import WhitenedTask, solve_level, stack_rows, start
from tests.shapes import check, checked, form


def test_arguments_that_do_not_fit_together_are_found():
    fitting = WhitenedTask(np.zeros((2, 3)), np.zeros(2))
    J, f = stack_rows([fitting, fitting], {0, 1})
    assert (J.shape, f.shape) == ((4, 3), (4,))
    assert stack_rows([fitting, fitting], {0, 1})[0].shape == (4, 3)
    with pytest.raises(TypeCheckError):
        solve_level(np.zeros((2, 3)), np.zeros(3), start(3))
    assert start(3).u.shape == (3,)
    with pytest.raises(TypeCheckError):
        start(3.0)


def test_a_result_whose_shape_follows_values_is_found():
    @checked(typechecker=check)
    def first(x: Float[np.ndarray, " n"], count: int) -> Float[np.ndarray, " n"]:
        return x[:count]

    assert np.array_equal(first(np.ones(3), 3), np.ones(3))
    assert np.array_equal(first(np.ones(3), 4), np.ones(3))
    with pytest.raises(TypeCheckError):
        first(np.ones(3), 2)


def test_forms_differ_where_annotations_may():
    values = [1, 1.0, True, None, "idv", "chain", [1], [1.0], (1,), frozenset({1}), np.ones(2)]
    values += [np.ones(3), np.ones((1, 2)), np.ones(2, int), [np.ones(2)], [np.ones(3)], []]
    assert len({form(value) for value in values}) == len(values)
