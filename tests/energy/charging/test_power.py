"""Power that a vehicle takes from a socket: plugs, phases, the station's limit, cold batteries."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from energy.charging.charging import Charging, Connector, PowerCurve
from energy.charging.power import accepted_power, at_battery_temperature, drawn_j, fits, is_direct, limited

pytestmark = pytest.mark.nojit


def curve(soc: list[float], power_kw: list[float]) -> PowerCurve:
    return PowerCurve(np.array(soc, np.float64), 1000.0 * np.array(power_kw, np.float64))


def car(*plugs: Connector, ac_kw: float = 11.0, phases: int = 3, one_phase_kw: float | None = None) -> Charging:
    return Charging(
        connectors=plugs,
        dc=None if plugs in {(Connector.TYPE2,), (Connector.TYPE1,)} else CURVE,
        ac_power_w=1000.0 * ac_kw,
        ac_phases=phases,
        ac_one_phase_w=None if one_phase_kw is None else 1000.0 * one_phase_kw,
    )


CURVE = curve([0, 0.5, 0.8, 1], [100, 100, 50, 20])
EUROPEAN = car(Connector.TYPE2, Connector.CCS2)


def power_kw(charging: Charging, connector: Connector, output_kw: float, phases: int | None = None) -> float:
    found = accepted_power(charging, connector, 1000.0 * output_kw, phases)
    assert found is not None
    assert found.power_w[0] == found.power_w[-1]
    return float(found.power_w[0]) / 1000.0


def test_direct_current_is_the_lesser_of_curve_and_station_with_a_point_where_they_cross() -> None:
    found = accepted_power(EUROPEAN, Connector.CCS2, 80_000.0)
    assert found is not None
    # 0.95 · 80 kW = 76 kW, which 100 − 50·(s − 0.5)/0.3 reaches at 0.5 + 0.3 · 24/50 = 0.644
    assert found.soc_frac.tolist() == pytest.approx([0.0, 0.644, 0.8, 1.0])
    assert found.power_w.tolist() == pytest.approx([76_000.0, 76_000.0, 50_000.0, 20_000.0])


def test_station_above_the_curve_leaves_it_as_it_is() -> None:
    found = accepted_power(EUROPEAN, Connector.CCS2, 350_000.0)
    assert found is not None
    assert found.soc_frac.tolist() == CURVE.soc_frac.tolist()
    assert found.power_w.tolist() == CURVE.power_w.tolist()


def test_station_below_the_curve_is_constant() -> None:
    found = accepted_power(EUROPEAN, Connector.CCS2, 20_000.0)
    assert found is not None
    assert found.soc_frac.tolist() == [0.0, 1.0]
    assert found.power_w.tolist() == [19_000.0, 19_000.0]


@pytest.mark.parametrize(
    ("charger", "output_kw", "phases", "drawn_kw"),
    [
        (EUROPEAN, 22.0, 3, 11.0),
        (EUROPEAN, 11.0, 3, 11.0),
        (EUROPEAN, 22.0, None, 11.0),
        (EUROPEAN, 7.4, None, 11.0 / 3.0),
        (EUROPEAN, 7.4, 1, 11.0 / 3.0),
        (EUROPEAN, 3.7, 1, 11.0 / 3.0),
        (EUROPEAN, 2.3, 1, 2.3),
        (EUROPEAN, 43.0, 3, 11.0),
        (car(Connector.TYPE2, one_phase_kw=7.4), 7.4, 1, 7.4),
        (car(Connector.TYPE2, one_phase_kw=7.4), 22.0, 3, 11.0),
        (car(Connector.TYPE2, one_phase_kw=7.4), 14.0, 2, 22.0 / 3.0),
        (car(Connector.TYPE2, ac_kw=7.4, phases=1), 22.0, 3, 22.0 / 3.0),
        (car(Connector.TYPE2, ac_kw=7.4, phases=1), 11.0, 3, 11.0 / 3.0),
        (car(Connector.TYPE2, ac_kw=7.4, phases=1), 7.4, 1, 7.4),
        (car(Connector.TYPE2, ac_kw=7.2, phases=2), 11.0, 3, 7.2),
        (car(Connector.TYPE2, ac_kw=22.0, phases=3), 7.4, 1, 22.0 / 3.0),
        (car(Connector.TYPE2, ac_kw=43.0, phases=3), 43.0, 3, 43.0),
    ],
)
def test_alternating_current_is_shared_by_phases(
    charger: Charging, output_kw: float, phases: int | None, drawn_kw: float
) -> None:
    assert power_kw(charger, Connector.TYPE2, output_kw, phases) == pytest.approx(0.9 * drawn_kw)


def test_type_1_and_household_sockets_have_one_phase_whatever_is_said_of_them() -> None:
    american = car(Connector.CCS1, ac_kw=11.5, phases=1)
    assert power_kw(american, Connector.TYPE1, 19.2, 3) == pytest.approx(0.9 * 11.5)
    assert power_kw(EUROPEAN, Connector.DOMESTIC, 2.3, 3) == pytest.approx(0.9 * 2.3)


@pytest.mark.parametrize(
    ("plugs", "fitting"),
    [
        ({Connector.TYPE2, Connector.CCS2}, {Connector.TYPE2, Connector.CCS2}),
        ({Connector.CCS2}, {Connector.TYPE2, Connector.CCS2}),
        ({Connector.TYPE2, Connector.TESLA_EU}, {Connector.TYPE2, Connector.TESLA_EU}),
        ({Connector.TESLA_EU}, {Connector.TYPE2, Connector.TESLA_EU}),
        ({Connector.CCS1}, {Connector.TYPE1, Connector.CCS1}),
        ({Connector.NACS}, {Connector.TYPE1, Connector.NACS}),
        ({Connector.NACS, Connector.CCS1}, {Connector.TYPE1, Connector.NACS, Connector.CCS1}),
        ({Connector.TYPE1, Connector.CHADEMO}, {Connector.TYPE1, Connector.CHADEMO}),
        ({Connector.GBT_AC, Connector.GBT_DC}, {Connector.GBT_AC, Connector.GBT_DC}),
    ],
)
def test_plugs_that_fit_are_those_named_those_within_them_and_adapters_that_come_with_the_car(
    plugs: set[Connector], fitting: set[Connector]
) -> None:
    charging = car(*sorted(plugs))
    assert {connector for connector in Connector if fits(charging, connector)} == fitting | {Connector.DOMESTIC}


def test_plug_that_does_not_fit_gives_nothing() -> None:
    assert accepted_power(EUROPEAN, Connector.CHADEMO, 50_000.0) is None
    assert accepted_power(EUROPEAN, Connector.TESLA_EU, 150_000.0) is None
    assert accepted_power(EUROPEAN, Connector.CCS2, 0.0) is None
    assert accepted_power(car(Connector.CCS2, ac_kw=0.0), Connector.TYPE2, 22_000.0) is None
    assert accepted_power(car(Connector.CCS2, ac_kw=0.0), Connector.DOMESTIC, 2_300.0) is None


def test_nacs_is_alternating_up_to_its_most_and_direct_above() -> None:
    american = car(Connector.NACS, ac_kw=11.5, phases=1)
    assert not is_direct(Connector.NACS, 11_500.0)
    assert power_kw(american, Connector.NACS, 11.5) == pytest.approx(0.9 * 11.5)
    found = accepted_power(american, Connector.NACS, 250_000.0)
    assert found is not None
    assert found.power_w.tolist() == CURVE.power_w.tolist()


def test_what_is_drawn_is_what_arrives_over_the_efficiency_of_its_way() -> None:
    assert drawn_j(EUROPEAN, Connector.CCS2, 150_000.0, 9.5e6) == pytest.approx(1e7)
    assert drawn_j(EUROPEAN, Connector.TYPE2, 11_000.0, 9e6) == pytest.approx(1e7)


def test_cold_battery_takes_its_share_of_the_curve_and_all_of_alternating_current() -> None:
    charging = Charging(
        connectors=(Connector.CCS2,), dc=CURVE, ac_power_w=11e3, ac_phases=3, cold_curve=((-10.0, 0.25), (20.0, 1.0))
    )
    for celsius, factor in ((-30.0, 0.25), (-10.0, 0.25), (5.0, 0.625), (20.0, 1.0), (40.0, 1.0)):
        cold = at_battery_temperature(charging, celsius)
        assert cold.dc is not None
        assert cold.dc.power_w.tolist() == pytest.approx((CURVE.power_w * factor).tolist())
        assert cold.ac_power_w == charging.ac_power_w
    assert at_battery_temperature(EUROPEAN, -30.0) is EUROPEAN


@given(
    st.lists(st.floats(1.0, 400.0), min_size=2, max_size=8),
    st.floats(0.5, 500.0),
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20),
)
def test_limited_curve_is_the_lesser_of_both_everywhere(powers: list[float], most_kw: float, at: list[float]) -> None:
    whole = curve(np.linspace(0.0, 1.0, len(powers)).tolist(), powers)
    found = limited(whole, 1000.0 * most_kw)
    charges = np.concatenate((at, whole.soc_frac))
    expected = np.minimum(np.interp(charges, whole.soc_frac, whole.power_w), 1000.0 * most_kw)
    assert np.interp(charges, found.soc_frac, found.power_w) == pytest.approx(expected, rel=1e-9)


@given(st.sampled_from(list(Connector)), st.floats(1.0, 400.0), st.floats(1.0, 3.0), st.sampled_from([None, 1, 2, 3]))
def test_more_output_never_gives_less(
    connector: Connector, output_kw: float, factor: float, phases: int | None
) -> None:
    every = car(*(c for c in Connector if c is not Connector.NACS), one_phase_kw=7.0)
    less = accepted_power(every, connector, 1000.0 * output_kw, phases)
    more = accepted_power(every, connector, 1000.0 * output_kw * factor, phases)
    if less is None:  # a plug that this vehicle does not name
        assert connector is Connector.NACS
        return
    assert more is not None
    charges = np.linspace(0.0, 1.0, 101)
    at_less = np.interp(charges, less.soc_frac, less.power_w)
    at_more = np.interp(charges, more.soc_frac, more.power_w)
    assert bool(np.all(at_more >= at_less * (1.0 - 1e-12)))
