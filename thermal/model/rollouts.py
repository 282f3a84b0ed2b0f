"""Roll-outs as CasADi functions of θ: fully symbolic, and sparse behind a Callback, with one signature."""

from dataclasses import dataclass
from typing import Literal

import casadi as ca
import numpy as np
import scipy.sparse as sp

from thermal._types import FloatArray
from thermal.callback import ArrayFunction
from thermal.errors import ModelError
from thermal.model.factor import Matrix
from thermal.model.matrices import SymbolicModel
from thermal.model.step import IMPLICIT_EULER, Scheme, Stage, Stepper
from thermal.units import AIR_HEAT_CAPACITY

#: Beyond this many volumes the symbolic executor's LDL factors and tapes outgrow it (measured: 6,000 volumes).
LARGEST_SYMBOLIC = 8000


@dataclass(frozen=True)
class RolloutData:
    """What a roll-out of N steps starts from and is driven by.

    Parameters
    ----------
    initial : ndarray, shape (n,)
        States at the start [K].
    boundary : ndarray, shape (N, n_boundary)
        Boundary temperatures [K].
    heat : ndarray, shape (N, n_zone)
        Heat given to the zones [W].
    airflow : ndarray, shape (N, n_airflow)
        Directed airflows [kg/s]; no columns where the building has none.
    """

    initial: FloatArray
    boundary: FloatArray
    heat: FloatArray
    airflow: FloatArray

    def check(self, model: SymbolicModel) -> None:
        """Refuse shapes that do not fit the model, and values that are not finite.

        Parameters
        ----------
        model : SymbolicModel
            What the data must fit.

        Raises
        ------
        ModelError
            Naming the array, what was expected and what it got.
        """
        network = model.network
        columns = {"boundary": network.n_boundary, "heat": len(network.zones), "airflow": len(network.airflows)}
        shapes = {name: (len(self.boundary), count) for name, count in columns.items()}
        for name, shape in {"initial": (model.n_state,), **shapes}.items():
            value = getattr(self, name)
            ModelError.unless(value.shape == shape, name, f"shape {shape}", value.shape)
            if not np.isfinite(value).all():
                raise ModelError(f"{name}: expected finite values, got {value[~np.isfinite(value)][0]}")


def rollout(
    model: SymbolicModel,
    data: RolloutData,
    step: float,
    scheme: Scheme = IMPLICIT_EULER,
    executor: Literal["symbolic", "sparse"] = "sparse",
) -> ca.Function:
    """Make a roll-out, a CasADi function ``zone_temperatures(theta)``, differentiable once.

    Parameters
    ----------
    model : SymbolicModel
        On the grid (both executors) or reduced (sparse only).
    data : RolloutData
        Start and inputs.
    step : float
        Time step [s].
    scheme : Scheme
        Time stepping.
    executor : {"symbolic", "sparse"}
        ``mapaccum`` over a step with CasADi's LDL, or SuperLU behind a Callback with forward sensitivities.

    Returns
    -------
    casadi.Function
        θ (n_parameter,) to zone means over the steps (n_zone, N) [K].

    Raises
    ------
    ModelError
        When the data do not fit the model.
    ModelError
        When the symbolic executor is asked for a reduced model or too large a grid.
    """
    data.check(model)
    if executor == "sparse":
        return _sparse_rollout(model, data, step, scheme)
    ModelError.unless(executor == "symbolic", "executor", "'symbolic' or 'sparse'", repr(executor))
    if model.projection is not None:
        raise ModelError("symbolic executor: expected a grid model, got a reduced one; use executor='sparse'")
    most, count, where = f"at most {LARGEST_SYMBOLIC} volumes", str(model.network.n_node), "symbolic executor"
    ModelError.unless(model.network.n_node <= LARGEST_SYMBOLIC, where, most, count, "use executor='sparse'")
    return _symbolic_rollout(model, data, step, scheme)


def _sparse_rollout(model: SymbolicModel, data: RolloutData, step: float, scheme: Scheme) -> ca.Function:
    """Roll-out behind a Callback, with exact forward sensitivities as its Jacobian."""

    def run(theta: FloatArray, sensitivities: bool) -> tuple[FloatArray, FloatArray]:
        """Zone means (n_zone, N), and their sensitivities (n_zone N, n_parameter) in CasADi's column-major order."""
        stepper = Stepper(model.matrices(theta, sensitivities), step, scheme)
        states = data.initial[:, None]
        moved = np.zeros((states.size, theta.size)) if sensitivities else None
        means, mean_sensitivities = [], []
        for boundary, heat, airflow in zip(data.boundary, data.heat, data.airflow, strict=True):
            states, mean, moved, mean_moved = stepper.advance(
                states, boundary[:, None], heat[:, None], airflow[:, None], moved
            )
            means.append(mean[:, 0])
            if mean_moved is not None:
                mean_sensitivities.append(mean_moved)
        return np.array(means).T, np.concatenate(mean_sensitivities) if sensitivities else np.empty((0, theta.size))

    count, n_zone = data.heat.shape
    size = len(model.network.parameters)
    return ArrayFunction("rollout", lambda t: run(t, False)[0], size, (n_zone, count), lambda t: run(t, True)[1])


def _symbolic_rollout(model: SymbolicModel, data: RolloutData, step: float, scheme: Scheme) -> ca.Function:
    """``mapaccum`` over one symbolic step."""
    network, count = model.network, data.heat.shape[0]
    theta = ca.MX.sym("theta", len(network.parameters))
    steps = symbolic_step(model, step, scheme).mapaccum("rollout", count)
    inputs = [ca.DM(v.T) for v in (data.boundary, data.heat, data.airflow)]
    _, means = steps(ca.DM(data.initial), *inputs, ca.repmat(theta, 1, count))
    return ca.Function("rollout", [theta], [means], ["theta"], ["zone_temperatures"])


def symbolic_step(model: SymbolicModel, step: float, scheme: Scheme = IMPLICIT_EULER) -> ca.Function:
    """One step of the grid model as a CasADi function of everything.

    Parameters
    ----------
    model : SymbolicModel
        On the grid.
    step : float
        Time step [s].
    scheme : Scheme
        Time stepping.

    Returns
    -------
    casadi.Function
        ``(states (n,) [K], boundary (n_boundary,) [K], heat (n_zone,) [W], airflow (n_airflow,) [kg/s], θ)`` to
        ``(states (n,) [K], zone means over the step (n_zone,) [K])``.
    """
    network = model.network
    n = network.n_node
    theta = ca.MX.sym("theta", len(network.parameters))
    x, u = ca.MX.sym("states", n), ca.MX.sym("boundary", network.n_boundary)
    q, v = ca.MX.sym("heat", len(network.zones)), ca.MX.sym("airflow", len(network.airflows))
    kappa, heat = model.classes(theta)
    faces = len(model.class_flows)
    flow = _assembled(model.class_flows, kappa[:faces])
    capacity = _assembled(model.class_masses, heat)
    stiffness, exchange = flow[:, :n], flow[:, n:]
    heating, observation = ca.DM(network.heating.tocsc()), ca.DM(network.observation.tocsc())
    mixing = _symbolic_mixing(network.airflows, len(network.zones), v) if network.airflows else None
    given = heating @ q
    if model.sources.signal.size:
        given = given + ca.DM(model.sources.spread) @ (kappa[faces:] * u[model.sources.signal.tolist()])
    matrix = capacity + scheme.implicit * step * stiffness
    response = ca.solve(matrix, ca.densify(heating), "ldl") if mixing is not None else ca.MX()

    def inflow(state: ca.MX) -> ca.MX:
        own = -(stiffness @ state) - exchange @ u + given
        return own if mixing is None else own + heating @ (mixing @ (observation @ state))

    def solved(stage: Stage, rhs: ca.MX) -> ca.MX:
        free = ca.solve(matrix, rhs, "ldl")
        if mixing is None:
            return free
        scale = stage.implicit * step
        zones = ca.solve(ca.MX.eye(len(network.zones)) - scale * observation @ response @ mixing, observation @ free)
        return free + scale * response @ (mixing @ zones)

    trail = [x]
    for stage in scheme.stages:
        rhs = capacity @ _weighted_sum(stage.weights, trail) + stage.implicit * step * (given - exchange @ u)
        if stage.explicit:
            rhs = rhs + stage.explicit * step * inflow(x)
        trail.append(solved(stage, rhs))
    mean = ca.DM(network.reading.tocsc()) @ _weighted_sum(scheme.mean, trail)
    return ca.Function("step", [x, u, q, v, theta], [trail[-1], mean])


def _weighted_sum(weights: tuple[float, ...], terms: list[ca.MX]) -> ca.MX:
    return sum(w * t for w, t in zip(weights[1:], terms[1:], strict=False)) + weights[0] * terms[0]


def _symbolic_mixing(airflows: tuple[tuple[int, int], ...], n_zone: int, flow: ca.MX) -> ca.MX:
    """M(t), shape (n_zone, n_zone) [W/K]."""
    total = ca.MX(n_zone, n_zone)
    for k, (source, target) in enumerate(airflows):
        unit = np.zeros((n_zone, n_zone))
        unit[target, source], unit[target, target] = AIR_HEAT_CAPACITY, -AIR_HEAT_CAPACITY
        total = total + flow[k] * ca.DM(unit)
    return total


def _assembled(classes: list[Matrix], weights: ca.MX) -> ca.MX:
    """Sparse matrix ``Σ_c weights_c classes_c`` as an MX of the union's pattern."""
    union = sp.csc_matrix(sum((abs(c) for c in classes[1:]), abs(classes[0])))
    union.sort_indices()
    pattern = ca.Sparsity(union.shape[0], union.shape[1], union.indptr.tolist(), union.indices.tolist())
    columns = np.repeat(np.arange(union.shape[1]), np.diff(union.indptr))
    values = sp.csc_matrix(np.column_stack([np.asarray(c.tocsr()[union.indices, columns]).ravel() for c in classes]))
    return ca.MX(pattern, ca.DM(values) @ weights)
