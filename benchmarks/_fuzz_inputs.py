"""Spoilt inputs: trees of JSON or YAML, tables, texts and bytes, each spoilt in a few places by a seed."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pandas as pd

#: What stands where something else should: of other kinds, sizes and languages.
ODD: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 3, 10**9, -(10**30), 0.5, -0.0, 1e-300, 1e12, 1e300, float("nan"), float("inf"),
    -float("inf"), "", " ", "NaT", "nan", "None", "north", "outdoor", "A", "..", "../..", "/proc/self/mem", ".", "a/b",
    "\0", "ö€😀", "x" * 300, "9999-12-31T23:59:59Z", "0001-01-01", "2023-02-30", "1e5", "=1+1", "<b>", "\ud800",
    10**400, "'; --", "%2e",
    [], [None], [[]], {}, {"": None}, [1, 2], {"a": {"b": {}}},
)  # fmt: skip


def places(tree: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all that a tree holds, the tree itself last."""
    keys = tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    return [place for key in keys for place in places(tree[key], (*path, key))] + [path]


def odd(rng: np.random.Generator) -> Any:
    """Something odd."""
    return copy.deepcopy(ODD[int(rng.integers(len(ODD)))])


def word(rng: np.random.Generator) -> str:
    """Something odd as text that files can hold."""
    return str(odd(rng)).encode("utf-8", "replace").decode()


def spoil_tree(tree: Any, rng: np.random.Generator) -> Any:
    """Spoil a tree in one place, sometimes in more: replaced, dropped, doubled, added to, or taken from elsewhere."""
    tree = copy.deepcopy(tree)
    for _ in range(int(rng.geometric(0.7))):
        spots = places(tree)
        path = spots[int(rng.integers(len(spots)))]
        if not path:
            tree = odd(rng) if rng.random() < 0.3 else tree
            continue
        parent = tree
        for key in path[:-1]:
            parent = parent[key]
        kind, key = rng.random(), path[-1]
        if kind < 0.5:
            parent[key] = odd(rng)
        elif kind < 0.65:
            del parent[key]
        elif kind < 0.8 and isinstance(parent, list):
            parent.append(copy.deepcopy(parent[key]))
        elif kind < 0.8:
            parent[str(odd(rng))] = parent[key]
        elif kind < 0.9 and isinstance(parent[key], int | float):
            parent[key] = parent[key] * float(rng.choice([-1.0, 0.0, 1e-9, 1e6, 1e200]))
        else:
            other, spot = tree, spots[int(rng.integers(len(spots)))]
            try:
                for step in spot:
                    other = other[step]
            except (KeyError, IndexError, TypeError):
                continue  # it has just been spoilt
            parent[key] = copy.deepcopy(other)
    return tree


def spoil_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Spoil bytes in one to four places: turned, cut off, dropped, doubled, or something odd put in."""
    for _ in range(int(rng.integers(1, 5))):
        at, kind = int(rng.integers(max(len(data), 1))), rng.random()
        end = min(len(data), at + int(rng.integers(1, 40)))
        if kind < 0.35 and data:
            data = data[:at] + bytes([int(rng.integers(256))]) + data[at + 1 :]
        elif kind < 0.45:
            data = data[:at]
        elif kind < 0.6:
            data = data[:at] + data[end:]
        elif kind < 0.75:
            data = data[:end] + data[at:]
        else:
            data = data[:at] + word(rng).encode() + data[end if rng.random() < 0.5 else at :]
    return data


def spoil_plan(plan: str, rng: np.random.Generator) -> bytes:
    """Spoil a plan by its cells: one to three others, or a row or column twice or not at all."""
    cells = np.array([row.split(",") for row in plan.split()], dtype=object)
    for _ in range(int(rng.integers(1, 4))):
        row, column, kind = *(int(rng.integers(size)) for size in cells.shape), rng.random()
        if kind < 0.6:
            cells[row, column] = str(rng.choice([".", "#", "+", "A", "B", "C", "0", "", " A", "north"]))
        else:
            at, axis = (row, 0) if rng.random() < 0.5 else (column, 1)
            cells = np.delete(cells, at, axis) if kind < 0.8 else np.insert(cells, at, np.take(cells, at, axis), axis)
    return "\n".join(",".join(row) for row in cells.tolist()).encode()


_KINDS = ("datetime64[s]", "datetime64[ns]", "datetime64[us]", "object", "str", "float32", "int64", "bool", "category")


def spoil_frame(frame: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Spoil a table: cells, kinds of columns, their names, its stamps and rows."""
    frame = frame.copy()
    for _ in range(int(rng.integers(1, 4))):
        kind, column = rng.random(), int(rng.integers(max(frame.shape[1], 1)))
        if kind < 0.3 and frame.size:
            values = frame.iloc[:, column].astype(object).tolist()
            values[int(rng.integers(len(values)))] = odd(rng)
            frame.isetitem(column, pd.Series(values, index=frame.index, dtype=object))
        elif kind < 0.45 and frame.shape[1]:
            try:
                frame.isetitem(column, frame.iloc[:, column].astype(str(rng.choice(_KINDS))))
            except (TypeError, ValueError, OverflowError):
                continue
        elif kind < 0.6 and frame.shape[1]:
            names = list(frame.columns)
            names[column] = str(rng.choice(names)) if rng.random() < 0.5 else word(rng)
            frame.columns = pd.Index(names)
        elif kind < 0.85 and len(frame):
            frame = _restamped(frame, rng)
        else:
            rows = rng.permutation(len(frame)) if rng.random() < 0.5 else rng.integers(0, max(len(frame), 1), 3)
            frame = frame.iloc[rows[: len(frame)]] if len(frame) else frame
    return frame


def _restamped(frame: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Other stamps: one of another year or none, without a zone, of another kind, or of another name."""
    kind, index = rng.random(), frame.index
    if kind < 0.2 or not isinstance(index, pd.DatetimeIndex):
        return frame.set_axis(pd.Index(list(range(len(frame))), name="timestamp"), axis=0)
    if kind < 0.3:
        return frame.rename_axis(index=word(rng))
    if kind < 0.4:
        return frame.tz_localize(None) if index.tz is not None else frame
    stamps = index.tz_convert("UTC").tz_localize(None) if index.tz is not None else index
    values = stamps.to_numpy().astype("datetime64[us]")
    odd_years = ["NaT", "9999-12-31T23:59", "0001-01-01", "1677-09-20", "2262-04-12", "-0500-01-01", "1970-01-01"]
    if kind < 0.8:
        values[int(rng.integers(len(values)))] = np.datetime64(str(rng.choice(odd_years)))
    else:
        values = values + np.timedelta64(int(rng.integers(-(2**45), 2**45)), str(rng.choice(["us", "ms"])))
    zone = str(rng.choice(["UTC", "Europe/Berlin", "America/St_Johns"]))
    made = pd.DatetimeIndex(values.astype(f"datetime64[{rng.choice(['us', 'ms', 's'])}]"), name=index.name)
    return frame.set_axis(made.tz_localize("UTC") if zone == "UTC" or kind < 0.8 else made, axis=0)
