"""The ways to change tasks, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from types import MappingProxyType
from typing import Any

from opspace.compare import controllers as others
from opspace.compare.blendings import CrossFade, Present
from opspace.compare.laws import continuous_inverse, damped_inverse
from opspace.compare.projections import BarrierProgram
from opspace.compare.strict_program import StrictProgramController, daqp_installed
from opspace.compare.tsid_controller import TsidController
from opspace.compare.tsid_model import lacks_in_tsid, tsid_installed
from opspace.controller import Controller, ReferenceController
from opspace.robots.protocol import Robot
from opspace.scenario import Scenario
from opspace.scenario.build import build_robot


@dataclass(frozen=True)
class Method:
    """One way to change tasks.

    Attributes:
        title: What it does.
        limits: What it does near joint limits and singular directions.
        controller: Makes the controller.
        changes: What it changes in a scenario.
        profile: Profile of every event; None leaves them as they are.
        installed: Whether the package that it needs is there.
        lacks: Says what it lacks for a scenario with this robot; empty where that is nothing.
        stands: Whether it can drive a robot that stands on contacts.
        bolted: Whether it can drive one that is bolted down.
    """

    title: str
    limits: str
    controller: Callable[..., ReferenceController] = Controller
    changes: Mapping[str, Any] = field(default_factory=dict[str, Any])
    profile: str | None = None
    installed: Callable[[], bool] = lambda: True
    lacks: Callable[[Scenario, Robot], str] = lambda scenario, robot: ""
    stands: bool = True
    bolted: bool = True

    def scenario(self, scenario: Scenario) -> Scenario:
        """Write down what this method runs in place of a scenario."""
        changes = dict(self.changes)
        if self.profile is not None:
            profile = {"profile": self.profile}
            changes["events"] = [event.model_copy(update=profile) for event in scenario.events]
        return scenario.model_copy(update=changes)


TSID_TASKS = ("position", "orientation", "pose", "posture", "joint", "com")
"""Types of tasks that TSID has as well."""


def _lacks_in_tsid(scenario: Scenario, robot: Robot) -> str:
    if scenario.collisions is not None:
        return "it keeps nothing apart"
    others = [name for name, task in scenario.tasks.items() if task.type not in TSID_TASKS]
    if others:
        return f"it has no task like {', '.join(map(repr, others))}"
    return lacks_in_tsid(robot)


_FADE, _SWITCH = "both fade", "both switch"
_NO_BUFFER = "joint limits fade; no sigma buffer"

METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "opspace": Method(
            "the library's default: intermediate desired values while few tasks move",
            _FADE,
            changes={"blending": "auto"},
        ),
        "chain": Method("chain blending, k + 1 hard torques", _FADE, changes={"blending": "chain"}),
        "switch": Method("hard switch", _SWITCH, changes={"method": "switch"}),
        "cross-fade": Method(
            "linear cross-fade of the hard torques before and after each change",
            _FADE,
            others.blended_by(CrossFade),
            profile="linear",
        ),
        "gain-ramp": Method(
            "gains ramped from and to zero; the task's directions are taken at once",
            _FADE,
            others.blended_by(Present),
        ),
        "soft-weights": Method(
            "weighted least squares, weights ramped; 100 to 1 from level to level",
            _NO_BUFFER,
            partial(ReferenceController, law=others.soft_weights),
        ),
        "continuous-inverse": Method(
            "Mansard's continuous inverse at every level",
            "joint limits fade; damping near singularities",
            partial(ReferenceController, law=others.level_by_level(continuous_inverse)),
        ),
        "damped": Method(
            "hard switch, damped least squares",
            "joint limits switch; damping near singularities",
            partial(ReferenceController, law=others.level_by_level(damped_inverse)),
            {"method": "switch"},
        ),
        "rate-clamp": Method(
            "hard switch, torque clamped to 1 N·m per ms",
            _SWITCH,
            others.RateClampController,
            {"method": "switch"},
        ),
        "as-printed": Method(
            "the paper's Eq. 15-23 to the letter",
            _NO_BUFFER,
            partial(ReferenceController, law=others.as_printed),
        ),
        "cbf-qp": Method(
            "the library's law, then a quadratic program with control barriers, α = 10/s",
            "joint ranges, speeds and distances are barriers",
            BarrierProgram,
            stands=False,
        ),
        "hierarchy": Method(
            "strict priorities by one quadratic program per level; the forces of contacts are ramped",
            "cones, motors and joints are hard in every program",
            StrictProgramController,
            installed=daqp_installed,
            bolted=False,
        ),
        "hierarchy-switch": Method(
            "the same programs, hard switch",
            "cones, motors and joints are hard in every program",
            StrictProgramController,
            {"method": "switch"},
            installed=daqp_installed,
            bolted=False,
        ),
        "tsid": Method(
            "TSID: one quadratic program, 100 to 1 from level to level, weights ramped; on contacts "
            "10 to 1, changed as TSID offers",
            "no joint limits for an arm; no sigma buffer",
            TsidController,
            installed=tsid_installed,
            lacks=_lacks_in_tsid,
        ),
    }
)
"""Every method by name, the library's own first."""


def methods_left_out(scenario: Scenario) -> dict[str, str]:
    """Say of every method that cannot run a scenario why, by name."""
    robot = build_robot(scenario)
    stands = bool(scenario.contacts) or robot.floating_base
    found = {name: _why_not(method, scenario, robot, stands) for name, method in METHODS.items()}
    return {name: why for name, why in found.items() if why}


def _why_not(method: Method, scenario: Scenario, robot: Robot, stands: bool) -> str:
    if not method.installed():
        return "what it needs is not installed: asked for by name it says what that is"
    if stands and not method.stands:
        return "it drives no robot that stands on contacts"
    if not stands and not method.bolted:
        return "it drives no robot that is bolted down"
    return method.lacks(scenario, robot)
