"""A day of google/sbsim's own converged solver, reproduced by a graph built by hand from its cells."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal.model.matrices import Matrices, SymbolicModel
from thermal.model.step import Stepper
from thermal.network.graph import GraphBuilder
from thermal.network.network import ThermalNetwork

FloatArray = NDArray[np.float64]

REFERENCE = Path(__file__).parents[3].parent / "shared" / "data" / "sbsim_uniform.npz"
STEP = 300.0
SIDE = 0.5

pytestmark = pytest.mark.skipif(
    not REFERENCE.is_file(), reason=f"the reference trajectory of google/sbsim is not here: {REFERENCE}"
)


@cache
def reference() -> dict[str, Any]:
    with np.load(REFERENCE) as stored:
        data: dict[str, Any] = dict(stored)
    return data | {"meta": json.loads(str(data["meta_json"]))}


def cells_network(data: dict[str, Any]) -> tuple[ThermalNetwork, NDArray[np.bool_]]:
    """Graph of the reference's cells: nodes of the rim lie on the facade, so their cells are halves and quarters."""
    height, film = data["meta"]["fh"] / 100.0, data["meta"]["h"]
    inside = data["floor_plan"] != 2
    outside = np.zeros(inside.shape, dtype=int)  # neighbours outside: one of an edge, two of a corner
    for axis in (0, 1):
        for shift in (1, -1):
            outside += inside & ~np.roll(inside, shift, axis)
    assert (np.where(inside, 4 - outside, 0) == data["n_neighbors"]).all()
    graph = GraphBuilder(tuple(data["meta"]["zones"]), ("outdoor",), {})
    node = np.full(inside.shape, -1)
    node[inside] = graph.volumes("cell", data["zone_index"][inside])
    share = 0.5 ** outside[inside]
    heat = data["density"] * data["heat_capacity"]
    for value in np.unique(heat[inside]):
        same = heat[inside] == value
        graph.capacity(f"heat {value:g}", float(value), node[inside][same], share[same] * SIDE**2 * height)
    conductivity = ca.SX(float(np.unique(data["conductivity"][inside]).item()))
    for axis in (0, 1):
        first, second = (node[:-1], node[1:]) if axis == 0 else (node[:, :-1], node[:, 1:])
        rim = outside > 0
        rim = rim[:-1] & rim[1:] if axis == 0 else rim[:, :-1] & rim[:, 1:]
        joined = (first >= 0) & (second >= 0)
        area = np.where(rim[joined], 0.5, 1.0) * SIDE * height
        graph.face("conduction", conductivity, first[joined], second[joined], area / SIDE)
    exposed = outside > 0  # an edge: one whole side; a corner: two halves
    graph.face("film", ca.SX(film), node[exposed], graph.boundary("outdoor"), SIDE * height)
    zones = range(len(graph.zones))
    columns = np.column_stack([(data["zone_index"] == z)[inside] for z in zones]).astype(float)
    mean = sp.csr_matrix((columns / columns.sum(axis=0)).T)
    heating = sp.csr_matrix(columns * data["diffusers"][inside][:, None])
    return graph.finish(mean, heating, (), SIDE), inside


@cache
def replayed() -> tuple[Matrices, FloatArray, float]:
    """States at the start of each step and at the end (289, n) [K], and the heat that left over the day [J]."""
    data = reference()
    network, inside = cells_network(data)
    matrices = SymbolicModel(network).matrices(network.start())
    stepper = Stepper(matrices, STEP)
    states = data["fields_hourly"][0][inside][:, None]
    path, lost = [states[:, 0]], 0.0
    exchange = -matrices.flow[:, matrices.n :].toarray()[:, 0]
    for outdoor, heat in zip(data["Tamb"], data["Q"], strict=True):
        states = stepper.advance(states, np.array([[outdoor]]), heat[:, None])[0]
        lost += STEP * float(exchange @ (states[:, 0] - outdoor))
        path.append(states[:, 0])
    return matrices, np.array(path), lost


def test_zone_temperatures_are_those_of_sbsim() -> None:
    matrices, path, _ = replayed()
    found = (matrices.observation @ path.T).T
    assert np.abs(found - reference()["Tzone"]).max() < 1e-5


def test_fields_are_those_of_sbsim() -> None:
    data = reference()
    _, path, _ = replayed()
    inside = data["floor_plan"] != 2
    assert np.abs(path[::12] - data["fields_hourly"][:, inside]).max() < 1e-5


def test_heat_of_the_day_is_stored_or_lost() -> None:
    data = reference()
    matrices, path, lost = replayed()
    stored = float(matrices.capacity.diagonal() @ (path[-1] - path[0]))
    given = STEP * float(data["Q"].sum())
    through = STEP * float(np.abs(data["Q"]).sum()) + abs(lost)
    assert abs(given - lost - stored) < 1e-9 * through
    # the reference's own fields close it too, as far as they are converged
    last = data["fields_hourly"][-1][data["floor_plan"] != 2]
    assert float(matrices.capacity.diagonal() @ (last - path[0])) == pytest.approx(given - lost, abs=1e-6 * through)
