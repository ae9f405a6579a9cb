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


def test_the_table_is_that_of_the_file_and_priorities_save_as_many_as_weights(pushes):
    from buffer_document import block, read_csv

    rows = read_csv(pushes.CSV)
    assert block(pushes.DOCUMENT, "pushes") == pushes.table(rows)
    stood = {law: sum(row[law] == "True" for row in rows) for law in pushes.LAWS}
    assert stood["weighted"] <= stood["ours"] < len(rows)
    for row in rows:
        impulse, angle, duration, frame = pushes.draw(int(row["number"]))
        assert row["frame"] == frame
        assert float(row["impulse"]) == pytest.approx(impulse, rel=1e-3)
        assert float(row["angle"]) == pytest.approx(angle, rel=1e-3)
        assert float(row["duration"]) == pytest.approx(duration, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("which", [0, 3, 509])
def test_a_push_is_its_number(pushes, which):
    from buffer_document import read_csv

    row = next(row for row in read_csv(pushes.CSV) if int(row["number"]) == which)
    for law in pushes.LAWS:
        stood, _, error = pushes.stand_and_be_pushed(which, law)
        assert str(stood) == row[law]
        assert error == pytest.approx(float(row[f"{law}_com"]), rel=0.05)
