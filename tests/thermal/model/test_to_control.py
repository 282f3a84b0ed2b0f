"""A reduced model as python-control has it: poles, responses and steady gains are those of the model itself."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import control
import numpy as np
import pytest

from thermal import ModelError, SymbolicModel, build_network, load_bundled_case, reduced_model
from thermal.effects.catalogue import chosen
from thermal.effects.effect import ALIKE
from thermal.model.modal import ModalModel, modal_model
from thermal.model.reduce import ReducedModel

EFFECTS = {"solar_gain": {"solar_heat_gain_coefficient": 0.5}, "sensor_lag": {"sensor_lag": 5.0}}
WHERE: dict[str, tuple[str, ...]] = {"solar_gain": (), "sensor_lag": ALIKE}


@cache
def reduced(effect: str = "") -> ReducedModel:
    network = build_network(load_bundled_case().building, dx=1.5, effects=chosen({effect: WHERE[effect]} if effect else []))
    return reduced_model(SymbolicModel(network), [network.values(EFFECTS.get(effect, {}))], order=40)


def modes(effect: str = "") -> ModalModel:
    return modal_model(reduced(effect).matrices(reduced(effect).theta))


@pytest.mark.parametrize("effect", ["", *EFFECTS])
def test_poles_are_the_rates_of_the_modes(effect: str) -> None:
    system, m = reduced(effect).to_control(), modes(effect)
    wanted = np.sort(-m.conductance / m.capacity)
    np.testing.assert_allclose(np.sort(system.poles().real), wanted, rtol=1e-12)
    assert not system.poles().imag.any() and (wanted < 0.0).all()


@pytest.mark.parametrize("effect", ["", *EFFECTS])
def test_a_step_of_heat_is_our_own_exact_run(effect: str) -> None:
    """12 h of 1 kW in the third zone, by exponentials of python-control and by the propagator of the modes."""
    system, m, step = reduced(effect).to_control(), modes(effect), 300.0
    times = np.arange(145) * step
    zone = system.input_labels.index("heat of F1_C")
    found = control.forced_response(system[:, zone], times, np.full(times.size, 1000.0)).outputs
    propagator, state = m.propagator(step), np.zeros(m.capacity.size)
    wanted = [m.output @ state]
    for _ in times[1:]:
        state = propagator.end * state + propagator.end_gain * (m.heating[:, 2] * 1000.0)
        wanted.append(m.output @ state)
    assert wanted[-1].max() > 1.0
    np.testing.assert_allclose(found.T, wanted, rtol=0, atol=1e-9)
    sampled = control.forced_response(
        reduced(effect).to_control(step=step)[:, zone], times, np.full(times.size, 1000.0)
    ).outputs
    np.testing.assert_allclose(sampled.T, wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize("effect", ["", *EFFECTS])
def test_the_response_at_no_frequency_is_the_steady_gain(effect: str) -> None:
    """``-O K⁻¹ [B H]`` of the matrices before they are brought into modes; all outdoors 1 K warmer, all zones are."""
    model = reduced(effect)
    m, system = model.matrices(model.theta), model.to_control()
    drive = np.hstack([-m.flow[:, m.n :], m.heating])
    wanted = m.output @ np.linalg.solve(m.flow[:, : m.n], drive)
    found = np.real(system(0.0))
    np.testing.assert_allclose(found, wanted, rtol=1e-7, atol=1e-9 * np.abs(wanted).max())
    np.testing.assert_allclose(found[:, 0], 1.0, rtol=1e-6)


def test_names_say_what_goes_in_and_out() -> None:
    system, network = reduced("solar_gain").to_control(), reduced("solar_gain").network
    assert system.output_labels == [f"temperature of {zone}" for zone in network.zones]
    assert system.input_labels[0] == "temperature of outdoor" and system.input_labels[-1] == "heat of F1_S"
    assert len(system.input_labels) == 1 + len(network.signals) + len(network.zones)
    assert repr(reduced()).startswith("ReducedModel(") and repr(modes()).startswith("ModalModel(")
    assert system.dt == 0 and reduced().to_control(step=60.0).dt == 60.0


def test_air_from_zone_to_zone_is_refused() -> None:
    model = reduced()
    mixed = SymbolicModel(replace(model.network, airflows=((0, 1),)))
    assert model.projection is not None
    with pytest.raises(ModelError, match="without airflows"):
        ReducedModel(mixed, model.projection, model.theta).to_control()
