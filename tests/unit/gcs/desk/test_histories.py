"""What was, for plots: bounded, with gaps where nobody was seen."""

import numpy as np

from gcs.desk.histories import MOST_SAMPLES, Histories, Quantity
from gcs.desk.observations import Outlook


def outlook(height_m: float) -> Outlook:
    return Outlook(np.array([0.0, 0.0, height_m]), speed_m_s=2.0, clearance_m=1.0, link_quality=0.5)


def test_a_series_has_one_line_per_vehicle_and_gaps():
    histories = Histories()
    histories.record(10.0, {1: outlook(1.0)})
    histories.record(11.0, {1: outlook(2.0), 2: outlook(5.0)})
    times_s, alpha, bravo = histories.series(Quantity.HEIGHT, [1, 2])
    np.testing.assert_array_equal(times_s, [0.0, 1.0])
    np.testing.assert_array_equal(alpha, [1.0, 2.0])
    np.testing.assert_array_equal(bravo, [np.nan, 5.0])
    np.testing.assert_array_equal(histories.series(Quantity.LINK, [1])[1], [50.0, 50.0])


def test_a_long_flight_keeps_its_beginning_in_bounded_memory():
    histories = Histories()
    for second in range(5 * MOST_SAMPLES):
        histories.record(float(second), {1: outlook(float(second))})
    times_s, heights_m = histories.series(Quantity.HEIGHT, [1], most=300)
    assert len(histories.times_s) <= MOST_SAMPLES
    assert len(times_s) <= 300
    np.testing.assert_array_equal(times_s, heights_m)
    assert times_s[0] == 0.0
    assert times_s[-1] > 4.9 * MOST_SAMPLES
