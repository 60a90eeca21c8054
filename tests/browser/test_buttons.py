"""Every button that `test_operator` does not press: what is asked for when it is pressed in a real browser."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from playwright.async_api import Page, expect

from gcs.desk.histories import Quantity
from gcs.desk.intents import NewMission
from gcs.dialect import COMPANION, Mode, mavlink
from gcs.planner.plan import FleetPlan
from gcs.settings import PlanningMode
from missions.faults import SimulatorFault
from missions.mission import Mission
from missions.occupancy import OccupancyBlock, encode_block
from missions.tunnel import PayloadType
from tests.browser.conftest import LARGE, OpenPage
from tests.browser.scripted_desk import ScriptedDesk
from tests.browser.scripted_plan import scripted_plan
from tests.browser.watching import OUT, button, choose, pixel_of, plots, row, shows, until
from tests.unit.gcs.messages import frame_of

pytestmark = pytest.mark.browser


@dataclass
class Choice:
    """Two planners to choose from."""

    algorithm: str = "ecpso"
    algorithms: tuple[str, ...] = ("ecpso", "pso")


class Simulator:
    """Takes down what shall go wrong."""

    def __init__(self) -> None:
        self.ordered: list[tuple[int, SimulatorFault]] = []

    async def order(self, fault: SimulatorFault, sysid: int) -> None:
        self.ordered.append((sysid, fault))


async def plan_buttons(page: Page, scripted: ScriptedDesk, choice: Choice) -> None:
    flight = scripted.desk.flight
    assert flight is not None
    await button(page, "Wait").click()
    await until(scripted.desk.taken_over.is_set, "nothing begins by itself any more")
    scripted.planning_s = 30.0
    await button(page, "Plan").click()
    await expect(button(page, "Cancel")).to_be_enabled()
    await button(page, "Cancel").click()
    await expect(page.locator(".gcs-head .phase")).to_have_text("Ready to plan")
    assert flight.plan is None
    scripted.planning_s = 0.2
    await choose(page, "Algorithm", "pso")
    await until(lambda: choice.algorithm == "pso", "the other one is chosen")
    await button(page, "Compare").click()
    await expect(page.locator(".gcs-head .phase")).to_have_text("Planned")
    await page.get_by_role("tab", name="Plans").click()
    for algorithm in choice.algorithms:
        await expect(page.locator(".gcs-plans tbody tr", has_text=algorithm).first).to_be_visible()
    assert choice.algorithm == "pso", "the choice stays as it was"


async def edit_buttons(page: Page, opened: list[tuple[NewMission | None, PlanningMode | None]]) -> None:
    await page.get_by_text("Edit mission").click()
    for name, node in (("Box", "box 1"), ("No-fly", "no-fly area 1")):
        await button(page, name).click()
        await shows(page, f"/world/{node}")
    await button(page, "Remove").click()
    await shows(page, "/world/no-fly area 1", there=False)
    await button(page, "Undo").click()
    await shows(page, "/world/no-fly area 1")
    await button(page, "Redo").click()
    await shows(page, "/world/no-fly area 1", there=False)
    await button(page, "Load draft").click()
    await until(lambda: len(opened) == 1, "the draft is opened")
    new = opened[0][0]
    assert new is not None
    assert [box.name for box in new.mission.world.boxes] == ["crate", "box 1"]
    assert new.content is not None
    assert b"box 1" in new.content


async def test_planning_comparing_editing_and_loading_what_was_edited(open_page: OpenPage):
    scripted, choice = ScriptedDesk("indoor"), Choice()
    opened: list[tuple[NewMission | None, PlanningMode | None]] = []
    desk = scripted.desk
    assert desk.flight is not None

    async def plan(mission: Mission, *_: object) -> FleetPlan:
        await scripted._plan(mission)
        return replace(scripted_plan(mission), algorithm=choice.algorithm)

    async def opener(new: NewMission | None, mode: PlanningMode | None) -> None:
        opened.append((new, mode))

    desk.planner, desk.opener, desk.flight.planner = choice, opener, plan
    desk.begins_s = desk.station.now_s + 600.0
    page = await open_page(scripted, LARGE)
    await plan_buttons(page, scripted, choice)
    await edit_buttons(page, opened)
    await choose(page, "Planned by", "onboard")
    await until(lambda: opened[-1][1] is PlanningMode.ONBOARD, "the mode is asked for")
    for theme in ("Light", "Dark"):
        await button(page, theme).click()
        await expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", theme.lower())


def seen_by(sysid: int, *voxels: tuple[int, int, int]) -> bytes:
    """A companion's report of what it has seen."""
    occupied = np.zeros((8, 8, 8), dtype=bool)
    for voxel in voxels:
        occupied[voxel] = True
    payload = encode_block(OccupancyBlock((3, 2, 0), 0.2, 1, occupied))
    padded = [*payload, *[0] * (128 - len(payload))]
    return frame_of(sysid, COMPANION, mavlink.MAVLink_tunnel_message(0, 0, PayloadType.OCCUPANCY, len(payload), padded))


async def test_several_vehicles_are_clicked_together_their_links_fail_and_what_they_see_is_drawn(open_page: OpenPage):
    scripted, simulator = ScriptedDesk("fleet-10"), Simulator()
    scripted.desk.simulator, scripted.pace = simulator, 0.0
    await scripted.begin(at_s=[0.4 * part.times_s[-1] for part in scripted_plan(scripted.mission).vehicles])
    page = await open_page(scripted, LARGE)
    await expect(page.locator(".gcs-overlay .tag.vehicle").first).to_be_visible()
    await page.mouse.click(*await pixel_of(page, scripted.vehicles[2].position_m))
    await expect(page.locator(".gcs-fleet tr.selected")).to_have_count(1)
    await page.keyboard.down("Shift")
    await page.mouse.click(*await pixel_of(page, scripted.vehicles[7].position_m))
    await page.keyboard.up("Shift")
    await expect(page.locator(".gcs-fleet tr.selected")).to_have_count(2)
    chosen = [scripted.vehicles[2], scripted.vehicles[7]]
    await expect(row(page, scripted.mission.vehicles[7].name)).to_have_class("selected")
    await button(page, "Hold").click()
    await until(lambda: all(vehicle.mode is Mode.HOLD for vehicle in chosen), "both hold")
    assert sum(vehicle.mode is Mode.HOLD for vehicle in scripted.vehicles) == 2
    scripted.air.say(seen_by(1, (0, 0, 0), (0, 0, 1)))
    await shows(page, "/observed")
    await page.get_by_role("tab", name="Orders").click()
    await button(page, "Replan").click()
    await expect(page.locator(".gcs-orders li").first).to_contain_text("Replan")
    await page.get_by_role("tab", name="Links").click()
    for name, told in (("Make bad", 0.3), ("Black out", 0.0), ("Make whole", 0.0)):
        simulator.ordered.clear()
        await button(page, name).click()
        await until(lambda: len(simulator.ordered) == 2, f"{name} reaches both")
        assert {sysid for sysid, _ in simulator.ordered} == {vehicle.sysid for vehicle in chosen}
        assert all(getattr(fault, "loss", None) == told for _, fault in simulator.ordered)
    await page.get_by_role("tab", name="Plots").click()
    for quantity in Quantity:
        await expect(page.get_by_text(f"{quantity.title} [{quantity.unit}]")).to_be_visible()
    await plots(page, len(Quantity))
    await page.screenshot(path=OUT / "page-plots.png")
    await page.get_by_role("tab", name="Fleet").click()
    await page.screenshot(path=OUT / "page-several.png")
