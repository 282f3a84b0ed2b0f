"""Reading a floor plan, and what a plan must keep to."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from thermal.case.building import EXTERIOR_WALL, INTERIOR_WALL, OUTSIDE
from thermal.errors import CaseError, describe


def read_plan(path: Path) -> NDArray[np.str_]:
    """Read a plan of tokens from CSV.

    Parameters
    ----------
    path
        CSV file, UTF-8; blanks around a token and blank lines at the end do not count.

    Returns
    -------
    ndarray of str
        Shape (n_row, n_col).

    Raises
    ------
    CaseError
        It is no UTF-8 text or no CSV.
    CaseError
        Its rows differ in length.
    CaseError
        A cell is blank.
    CaseError
        It has no row.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            rows = [[token.strip() for token in row] for row in csv.reader(stream, strict=True)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise CaseError(describe(path.name, "a CSV of tokens in UTF-8", f"{error}")) from error
    while rows and not any(rows[-1]):
        rows.pop()
    if not rows:
        raise CaseError(describe(path.name, "rows of tokens", "no row"))
    for number, row in enumerate(rows, start=1):
        if len(row) != len(rows[0]):
            expected = f"{len(rows[0])} cells as in row 1"
            raise CaseError(describe(f"{path.name}: row {number}", expected, f"{len(row)} cells"))
        if "" in row:
            where = f"{path.name}: row {number}, column {row.index('') + 1}"
            raise CaseError(describe(where, "'.', '#', '+' or a zone", "a blank", "write '.' for outside"))
    return np.array(rows, dtype=np.str_)


def check_plan(tokens: NDArray[np.str_], where: str) -> None:
    """Refuse a plan that does not bound each of its zones.

    Parameters
    ----------
    tokens
        Shape (n_row, n_col).
    where
        File or floor, for the message.

    Raises
    ------
    CaseError
        No cell is a zone.
    CaseError
        A zone's cell has the outside, or the edge of the plan, beside it (cells that meet at a corner only are let
        be).
    CaseError
        The cells of a zone do not hang together by their sides.
    """
    tokens = np.asarray(tokens, dtype=np.str_)
    if tokens.ndim != 2 or tokens.size == 0:
        raise CaseError(describe(where, "rows and columns of tokens", f"an array of shape {tokens.shape}"))
    is_zone = ~np.isin(tokens, [OUTSIDE, EXTERIOR_WALL, INTERIOR_WALL])
    if not is_zone.any():
        raise CaseError(describe(where, "at least one zone", "none"))
    _check_walls(tokens, is_zone, where)
    for zone in np.unique(tokens[is_zone]):
        parts, n_part = ndimage.label(tokens == zone)
        if n_part > 1:
            cells = [tuple(int(x) + 1 for x in np.argwhere(parts == part)[0]) for part in (1, 2)]
            found = f"{n_part} parts, with cells at row {cells[0][0]}, column {cells[0][1]} and row {cells[1][0]}, "
            found += f"column {cells[1][1]}"
            advice = "give the parts names of their own, or join them"
            raise CaseError(describe(f"{where}: zone {str(zone)!r}", "cells that hang together", found, advice))


def _check_walls(tokens: NDArray[np.str_], is_zone: NDArray[np.bool_], where: str) -> None:
    outside = np.pad(tokens == OUTSIDE, 1, constant_values=True)
    at_edge = np.pad(np.zeros(tokens.shape, dtype=bool), 1, constant_values=True)
    for d_row, d_col, side in ((-1, 0, "above"), (1, 0, "below"), (0, -1, "to the left"), (0, 1, "to the right")):
        rows = slice(1 + d_row, 1 + d_row + tokens.shape[0])
        cols = slice(1 + d_col, 1 + d_col + tokens.shape[1])
        touching = is_zone & outside[rows, cols]
        if touching.any():
            row, col = (int(x) for x in np.argwhere(touching)[0])
            what = "the edge of the plan" if at_edge[rows, cols][row, col] else "the outside ('.')"
            at = f"{where}: row {row + 1}, column {col + 1} (zone {str(tokens[row, col])!r})"
            raise CaseError(describe(at, f"a wall {side}", what, "draw '#' between zone and outside"))
