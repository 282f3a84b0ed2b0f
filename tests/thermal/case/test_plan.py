from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from thermal.case.plan import check_plan, read_plan
from thermal.errors import CaseError

Speller = Callable[..., str]


def tokens(*rows: str) -> np.ndarray:
    return np.array([list(row) for row in rows])


def write(tmp_path: Path, text: str, encoding: str = "utf-8") -> Path:
    path = tmp_path / "plan.csv"
    path.write_bytes(text.encode(encoding))
    return path


def test_reads_tokens_with_blanks_byte_order_mark_quotes_and_last_lines(tmp_path: Path) -> None:
    path = write(tmp_path, '\ufeff#,# ,"#"\r\n#, room 1,#\r\n#,#,#\r\n\r\n\r\n')
    assert read_plan(path).tolist() == [["#", "#", "#"], ["#", "room 1", "#"], ["#", "#", "#"]]


def test_rows_of_different_length(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=r"plan\.csv: row 2: expected 3 cells as in row 1, found 4 cells"):
        read_plan(write(tmp_path, "#,#,#\n#,A,#,#\n#,#,#\n"))


def test_blank_line_inside_is_a_ragged_row(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match="row 2: expected 3 cells as in row 1, found 0 cells"):
        read_plan(write(tmp_path, "#,#,#\n\n#,A,#\n#,#,#\n"))


@pytest.mark.parametrize("text", ["#,#,#\n#, ,#\n#,#,#\n", "#,#,#,\n#,A,#,\n#,#,#,\n"])
def test_blank_cell(tmp_path: Path, text: str) -> None:
    with pytest.raises(CaseError, match=r"row \d, column \d: expected '\.', '#', '\+' or a zone"):
        read_plan(write(tmp_path, text))


@pytest.mark.parametrize("text", ["", "\n\n", ",,\n,,\n"])
def test_file_without_rows(tmp_path: Path, text: str) -> None:
    with pytest.raises(CaseError, match="rows of tokens"):
        read_plan(write(tmp_path, text))


def test_file_of_another_encoding(tmp_path: Path) -> None:
    with pytest.raises(CaseError, match=r"plan\.csv: expected a CSV of tokens in UTF-8"):
        read_plan(write(tmp_path, "#,Küche,#\n", encoding="latin-1"))


def test_walled_plan_passes() -> None:
    check_plan(tokens("..####", "..#AA#", "###+##", "#BBBB#", "######"), "plan.csv")


def test_zones_that_touch_without_a_wall_between_them_pass() -> None:
    check_plan(tokens("####", "#AB#", "####"), "plan.csv")


def test_outside_at_a_corner_only_passes() -> None:
    check_plan(tokens(".#.", "#A#", ".#."), "plan.csv")


def test_plan_without_zones() -> None:
    with pytest.raises(CaseError, match=r"plan\.csv: expected at least one zone"):
        check_plan(tokens("###", "#+#", "#.#"), "plan.csv")


def test_zone_split_in_two() -> None:
    rows = ("#####", "#A+A#", "#####")
    message = r"zone 'A': expected cells that hang together, found 2 parts, .* row 2, column 2 and row 2, column 4"
    with pytest.raises(CaseError, match=message):
        check_plan(tokens(*rows), "plan.csv")


def test_zone_that_hangs_together_by_a_corner_only_is_split() -> None:
    with pytest.raises(CaseError, match="zone 'A'"):
        check_plan(tokens("####", "#AB#", "#BA#", "####"), "plan.csv")


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (("####", "#A.#", "####"), r"row 2, column 2 \(zone 'A'\): expected a wall to the right, found .*outside"),
        (("####", "#.A#", "####"), r"row 2, column 3 \(zone 'A'\): expected a wall to the left"),
        (("#.#", "#A#", "###"), "expected a wall above"),
        (("###", "#A#", "#.#"), "expected a wall below"),
        (("#A#", "#A#", "###"), "row 1, column 2 .*a wall above, found .*the edge of the plan"),
        (("###", "#A#", "#A#"), "a wall below, found .*the edge of the plan"),
        (("###", "AA#", "###"), "a wall to the left, found .*the edge of the plan"),
        (("###", "#AA", "###"), "a wall to the right, found .*the edge of the plan"),
    ],
)
def test_exterior_touching_a_zone_without_a_wall(rows: tuple[str, ...], message: str) -> None:
    with pytest.raises(CaseError, match=message):
        check_plan(tokens(*rows), "plan.csv")


def test_courtyard_needs_walls_too() -> None:
    with pytest.raises(CaseError):
        check_plan(tokens("#####", "#AAA#", "#A.A#", "#AAA#", "#####"), "plan.csv")
    check_plan(tokens(*["#" * 7, *["#AAAAA#"], "#A###A#", "#A#.#A#", "#A###A#", "#AAAAA#", "#" * 7]), "plan.csv")
