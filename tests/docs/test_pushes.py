"""What is said of the pushes is what their file has, and the file is what the script finds."""

import sys
from pathlib import Path

import pytest

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"


@pytest.fixture(scope="module")
def pushes():
    sys.path.insert(0, str(EVIDENCE))
    try:
        import pushes

        yield pushes
    finally:
        sys.path.remove(str(EVIDENCE))


def test_the_table_is_that_of_the_file_and_both_laws_save_nearly_the_same(pushes):
    from buffer_document import block

    rows = pushes.known(pushes.CSV)
    assert block(pushes.DOCUMENT, "pushes") == pushes.table(rows)
    lost = [row for row in rows.values() if not pushes.stood(row, "ours")]
    assert lost
    # Each of them was given to the other law as well, whatever else was.
    assert all(row["weighted"] for row in lost)
    assert sum(pushes.stood(row, "weighted") for row in lost) <= 0.01 * len(rows)
    for number, row in rows.items():
        drawn = pushes.draw(number)
        assert row["frame"] == drawn.frame
        for name in ("impulse", "angle", "duration"):
            assert float(row[name]) == pytest.approx(getattr(drawn, name), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("which", [0, 3, 9, 61, 300])
def test_a_push_is_its_number(pushes, which):
    row = pushes.known(pushes.CSV)[which]
    for law in pushes.LAWS:
        if row[law]:
            stood, _, error = pushes.stand_and_be_pushed(which, law)
            assert str(stood) == row[law]
            assert error == pytest.approx(float(row[f"{law}_com"]), rel=0.05)
