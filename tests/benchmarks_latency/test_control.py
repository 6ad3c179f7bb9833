"""The control loop: its circuit and its controller by calculation, and over real links."""

import numpy as np
import pytest

from benchmarks.latency import loop, rows
from benchmarks.latency.control import (
    PERIOD_S,
    STEP_S,
    Controller,
    Holding,
    Plant,
    at_the_plant,
    pushes,
)
from benchmarks.peers.pound.control import local_loop

TICK = round(PERIOD_S / STEP_S)


def test_the_circuit_is_that_of_the_pound_paper():
    """Its local run, in which each answer is held one period later."""
    plant, u, vc = Plant(np.zeros(50 * TICK)), 0.0, []
    for k in range(50):
        plant.advance(k * PERIOD_S)
        vc.append(plant.x[0])
        plant.held, u = u, 1.0 - plant.x[0]
    assert vc == pytest.approx(local_loop(50))


def closed(knows, input_s, answer_s, seconds=3.0):
    """(RMS difference to a controller at the plant, largest error of a forecast of Vc); in V.

    The delays are fixed. A forecast is for the time when the answer comes to the plant.
    """
    pushed = np.zeros(round(seconds / STEP_S))
    plant, controller, events = Plant(pushed), Controller(knows), []
    forecasts = []
    holding = Holding()
    for at in np.arange(round(seconds / PERIOD_S)) * PERIOD_S:
        for arrived in sorted(each for each in events if each[0] <= at):
            plant.advance(arrived[0])
            plant.held = arrived[1]
            holding.take(arrived[1], arrived[0] - answer_s, arrived[0])
        events = [each for each in events if each[0] > at]
        plant.advance(at)
        now = at + input_s
        voltage = controller.answer(plant.x.copy(), holding.report(at), input_s, now)
        events.append((now + answer_s, voltage))
        forecasts.append((round(events[-1][0] / STEP_S) - 1, 1.0 - events[-1][1]))
    plant.advance(seconds)
    error_v = np.array(plant.vc) - at_the_plant(pushed)
    wrong = [abs(vc - plant.vc[k]) for k, vc in forecasts[10:] if k < len(plant.vc)]
    return float(np.sqrt(np.mean(error_v**2))), max(wrong)


def test_a_controller_that_knows_ages_sees_ahead():
    aware, ignorant = (closed(knows, 0.025, 0.03) for knows in ("age", "nothing"))
    assert 0 < aware[0] < ignorant[0]
    assert aware[1] < 1e-3 < 0.05 < ignorant[1]
    assert closed("mean", 0.025, 0.03) == pytest.approx(aware)


def test_the_plant_reports_how_old_its_input_is():
    holding = Holding()
    assert np.isnan(holding.report(1.0)[1:]).all()
    holding.take(0.5, 1.97, 2.0)
    assert holding.report(2.02) == pytest.approx((0.5, 0.03, 0.04))
    holding.take(0.7, 2.02, 2.03)
    # Half of the time 0.055 s on average, half of it 0.015 s.
    assert holding.report(2.04) == pytest.approx((0.7, 0.01, 0.035))


def test_without_delay_there_is_nothing_to_correct():
    aware, ignorant = (closed(knows, 1e-9, 1e-9) for knows in ("age", "nothing"))
    assert aware == pytest.approx(ignorant, abs=1e-6)


@pytest.mark.slow
def test_ages_over_links_are_those_of_the_links_and_repeat_by_seed():
    one, again, other = (loop.run_loop(loop.OLD, "age", seed, 1.0) for seed in (1, 1, 2))
    assert np.array_equal(one.error_v, again.error_v)
    assert one.inputs_s == again.inputs_s != other.inputs_s
    assert len(one.inputs_s) >= 0.9 * one.n_sent
    assert min(one.inputs_s + one.answers_s) > 0
    assert np.std(one.inputs_s) > 5e-3


def test_pushes_are_the_same_whatever_the_controller_knows():
    a, b = (pushes(np.random.default_rng(1), 1.0) for _ in range(2))
    assert len(a) == round(1.0 / STEP_S)
    assert np.array_equal(a, b)


@pytest.mark.long
def test_a_loop_that_knows_how_old_things_are_strays_less():
    old, fresh = rows.corrections(3, 2)
    assert old.exact
    assert old.ok, old
    assert fresh.target is None
    assert fresh.peers["input_age_ms"] < old.peers["input_age_ms"]
