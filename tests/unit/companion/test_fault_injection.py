"""Faults that were ordered of a companion come when they are due, and to the right one."""

from companion.fault_injection import FaultInjection
from missions.faults import CompanionHang, CompanionKill, Fault

KILL, HANG = CompanionKill(vehicle=1, at_s=4.0), CompanionHang(vehicle=1, at_s=2.0)


class Kept(FaultInjection):
    """Keeps what is due instead of doing it."""

    def __init__(self, faults: tuple[Fault, ...], sysid: int) -> None:
        super().__init__(faults, sysid)
        self.due: list[tuple[float, Fault]] = []
        self.now_s = 0.0

    def carry_out(self, fault: Fault) -> None:
        self.due.append((self.now_s, fault))

    def run(self, control_from_s: float, until_s: float) -> list[tuple[float, Fault]]:
        while self.now_s < until_s:
            self.now_s = round(self.now_s + 0.5, 3)
            self.tick(in_control=self.now_s >= control_from_s, now_s=self.now_s)
        return self.due


def test_the_time_of_a_fault_counts_from_when_control_was_taken():
    assert Kept((KILL, HANG), 1).run(control_from_s=10.0, until_s=20.0) == [(12.0, HANG), (14.0, KILL)]


def test_without_control_nothing_happens():
    assert Kept((KILL,), 1).run(control_from_s=99.0, until_s=20.0) == []


def test_faults_of_other_vehicles_are_not_ours():
    assert Kept((KILL,), 2).run(control_from_s=0.0, until_s=20.0) == []
