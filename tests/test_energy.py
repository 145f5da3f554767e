"""Power of a rotary wing: the paper's own figures, its equation written out again, and momentum theory's identities."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mavplan.energy import GRAVITY_M_S2, PROPULSIVE_EFFICIENCY, RotaryWing, rotor_of

AT_THE_ROTOR = RotaryWing(efficiency=1.0)
SPEEDS = st.floats(0, 60)
MASSES = st.floats(0.1, 50)


def equation_12(v):
    """Term by term as printed, with the table's rounded powers."""
    p0, pi, v0 = 79.8563, 88.6279, 4.02854
    blades = p0 * (1 + 3 * v**2 / 120**2)
    induced = pi * math.sqrt(math.sqrt(1 + v**4 / (4 * v0**4)) - v**2 / (2 * v0**2))
    return blades + induced + 0.5 * 0.6 * 1.225 * 0.05 * 0.503 * v**3


def test_the_parameters_give_the_powers_of_the_papers_table():
    assert AT_THE_ROTOR.profile_w == pytest.approx(79.86, abs=0.01)
    assert AT_THE_ROTOR.induced_w == pytest.approx(88.63, abs=0.01)
    assert AT_THE_ROTOR.induced_m_s == pytest.approx(4.03, abs=0.01)
    assert AT_THE_ROTOR.tip_speed_m_s == 300 * 0.4
    assert AT_THE_ROTOR.disc_area_m2 == pytest.approx(math.pi * 0.4**2, abs=0.001)


@pytest.mark.parametrize("speed", [0, 1, 3, 5, 8, 10, 15, 20, 30])
def test_level_flight_takes_what_the_equation_says(speed):
    assert float(AT_THE_ROTOR.power_w(speed)) == pytest.approx(equation_12(speed), rel=1e-5)
    assert float(AT_THE_ROTOR.power_w(-speed)) == float(AT_THE_ROTOR.power_w(speed))


def test_a_kilogram_hovers_on_118_watts_from_the_battery():
    """168.48 W for 20 N at the rotor, 0.7 of what the battery gives."""
    assert rotor_of(1.0).hover_w == pytest.approx(
        168.484 / 20 * GRAVITY_M_S2 / PROPULSIVE_EFFICIENCY, rel=1e-5
    )
    assert rotor_of(1.0).hover_w == pytest.approx(118.0, abs=0.1)


@given(MASSES, SPEEDS, st.floats(-5, 10))
def test_every_power_is_proportional_to_mass(mass_kg, speed, climb):
    one, many = rotor_of(1.0), rotor_of(mass_kg)
    assert float(many.power_w(speed)) == pytest.approx(mass_kg * float(one.power_w(speed)))
    assert float(many.climb_power_w(climb)) == pytest.approx(mass_kg * float(one.climb_power_w(climb)))
    assert many.induced_m_s == pytest.approx(one.induced_m_s)


@given(MASSES)
def test_standing_still_is_hovering_whichever_way_it_is_asked(mass_kg):
    rotor = rotor_of(mass_kg)
    assert float(rotor.power_w(0.0)) == pytest.approx(rotor.hover_w)
    assert float(rotor.climb_power_w(0.0)) == pytest.approx(rotor.hover_w)


@given(st.floats(0.01, 20))
def test_a_climb_moves_the_air_as_momentum_theory_says(climb):
    """Thrust is the change of momentum: v_i·(V_c + v_i) = v0²; beyond the blades it takes W·(V_c + (1 + k)·v_i)."""
    rotor = AT_THE_ROTOR
    through = (float(rotor.climb_power_w(climb)) - rotor.profile_w) / rotor.weight_n
    induced = (through - climb) / (1 + rotor.induced_correction)
    assert induced * (climb + induced) == pytest.approx(rotor.induced_m_s**2)
    assert float(rotor.climb_power_w(climb)) > rotor.hover_w


@given(st.floats(-20, 0))
def test_a_descent_counts_as_hover(climb):
    assert float(rotor_of(2.0).climb_power_w(climb)) == pytest.approx(rotor_of(2.0).hover_w)


@given(st.floats(0, 1e4))
def test_no_speed_makes_the_induced_power_vanish_or_negative(speed):
    """Where the printed form subtracts two huge numbers."""
    rotor = AT_THE_ROTOR
    rest = rotor.profile_w * (1 + 3 * speed**2 / 120**2) + 0.00924263 * speed**3
    assert float(rotor.power_w(speed)) >= rest * (1 - 1e-5)


@pytest.mark.parametrize("mass_kg", [0.5, 2.0, 12.0])
def test_the_two_best_speeds_are_those_of_a_fine_grid_for_any_mass(mass_kg):
    """10.2 m/s lasts longest, at 126 W for 20 N; 18.3 m/s reaches furthest."""
    rotor, grid = rotor_of(mass_kg), np.arange(0.01, 60, 0.01)
    power = rotor.power_w(grid)
    assert rotor.endurance_speed_m_s() == pytest.approx(grid[power.argmin()], abs=0.01)
    assert rotor.range_speed_m_s() == pytest.approx(grid[(power / grid).argmin()], abs=0.01)
    assert rotor.endurance_speed_m_s() == pytest.approx(10.2, abs=0.05)
    assert rotor.range_speed_m_s() == pytest.approx(18.3, abs=0.05)
    assert float(AT_THE_ROTOR.power_w(10.2)) == pytest.approx(126, abs=0.1)


def test_shapes_are_kept():
    speeds = np.arange(6.0).reshape(2, 3)
    assert rotor_of(1.0).power_w(speeds).shape == rotor_of(1.0).climb_power_w(speeds).shape == (2, 3)
