"""A tick answers one number: what happened, and how many hard torques it took."""

import pytest

from opspace import Status
from opspace.controller.controller import STATUSES
from opspace.kernels.columns import SOLVE

EVERYTHING = sum(int(flag) for flag in Status)


def test_flags_are_bits_of_their_own():
    assert all(int(flag).bit_count() <= 1 for flag in Status)
    assert len({int(flag) for flag in Status}) == len(list(Status))


@pytest.mark.parametrize("solves", [0, 1, 7, 2**40])
def test_no_flag_is_read_as_hard_torques(solves):
    for status in (Status.OK, *Status, Status(EVERYTHING)):
        answer = int(status) + SOLVE * solves
        assert (STATUSES[answer % SOLVE], answer // SOLVE) == (status, solves), status


def test_every_pair_of_flags_has_its_status():
    assert SOLVE > EVERYTHING
    for a in Status:
        for b in Status:
            assert STATUSES[int(a) | int(b)] == a | b
