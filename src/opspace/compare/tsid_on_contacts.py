"""TSID for a robot that stands: contacts, cones, motors and joints in its one quadratic program."""

# The compiled module tsid has no type stubs, and is not a dependency.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from opspace.command import ContactStatus
from opspace.compare.laws import ten_to_one_weight
from opspace.compare.tsid_model import TsidModel
from opspace.contacts import GroundContact, PointContact, SoleContact
from opspace.controller import ReferenceController
from opspace.controller.contact_stages import Footing, contact_status
from opspace.errors import InputError
from opspace.law.scalars import STILLING
from opspace.robots.motor_range import motor_range
from opspace.stack import ContactMember, Member
from opspace.tasks import JointLimits, Task, TrackingTask

HARD, COST = 0, 1
"""TSID's two levels."""
FREE_FORCE, WANTED_FORCE = 1e-5, 1e-2
"""Weight of the forces of contacts of which nothing is wanted, and of those that are to press."""
TICK = 1e-3
"""Time step of TSID's joint bounds where a controller has no period, s."""


@dataclass(eq=False)
class _Held:
    """A contact in TSID's program.

    Attributes:
        made: TSID's contact.
        name: What TSID calls it.
        leaving: Whether TSID has been told to let it go.
    """

    made: Any
    name: str
    leaving: bool = False


class StandingProgram:
    """TSID's formulation for the robot of a controller, asked for changes as TSID offers them.

    Tasks are added and removed with the duration of the request, which TSID takes and does not use; one
    that changes its level has its weight set. Contacts are added at once and removed over the duration,
    in which TSID lowers their largest force. A contact that comes back while it goes is removed and
    added anew.

    Raises:
        InputError: TSID is not there, or the robot does not come from a URDF.
    """

    def __init__(self, controller: ReferenceController) -> None:
        self._model = model = TsidModel(controller.robot)
        tsid, robot = model.tsid, controller.robot
        self._formulation = tsid.InverseDynamicsFormulationAccForce("all", model.wrapper, False)
        self._solver = tsid.SolverHQuadProgFast("solver")
        self._tasks: dict[str, float] = {}
        self._references: dict[str, Any] = {}
        self._contacts: dict[str, _Held] = {}
        # TSID refers to them and does not own them, to a contact until its ramp is over.
        self._kept: list[Any] = []
        if controller.torque_limits == "priority":
            motors = motor_range(robot)
            bounds = tsid.TaskActuationBounds("limits: motors", model.wrapper)
            bounds.setBounds(motors.least[6:], motors.most[6:])
            self._formulation.addActuationTask(bounds, 1.0, HARD, 0.0)
            self._kept.append(bounds)
        if controller.stack.limits is not None:
            self._kept.append(self._joints(controller.stack.limits, controller.period))

    def solve(
        self,
        t: float,
        q: np.ndarray,
        v: np.ndarray,
        members: Sequence[Member],
        touching: Sequence[ContactMember],
    ) -> tuple[np.ndarray, bool, dict[str, ContactStatus]]:
        """Bring the formulation up to date and solve it.

        Returns:
            (n,) torque, N·m, whether it is one, and the contacts.
        """
        f, state = self._formulation, self._model.state(q, v)
        f.computeProblemData(t, *state)
        for member in touching:
            self._touch(member)
        for name in set(self._contacts) - {member.contact.name for member in touching}:
            del self._contacts[name]
        for member in members:
            self._ask(member, t)
        for name in set(self._tasks) - {m.task.name for m in members}:
            self._drop(name, 0.0)
        problem = f.computeProblemData(t, *state)
        self._solver.resize(f.nVar, f.nEq, f.nIn)
        found = self._solver.solve(problem)
        tau = np.concatenate([np.zeros(6), np.array(f.getActuatorForces(found))])
        contacts = {m.contact.name: self._told(m, found) for m in touching}
        return tau, found.status == 0, contacts

    def _ask(self, member: Member, t: float) -> None:
        name, duration = member.task.name, float(member.presence.ramp.duration)
        if member.leaving:
            if name in self._tasks:
                self._drop(name, duration)
            return
        weight = ten_to_one_weight(member.level)
        if name not in self._tasks:
            made = self._made(member.task)
            self._formulation.addMotionTask(made, weight, COST, duration)
            self._tasks[name], self._references[name] = weight, made
        elif self._tasks[name] != weight:
            self._formulation.updateTaskWeight(name, weight)
            self._tasks[name] = weight
        self._references[name].setReference(self._model.sample(member.task, t))

    def _drop(self, name: str, duration: float) -> None:
        self._formulation.removeTask(name, duration)
        del self._tasks[name], self._references[name]

    def _made(self, task: Task) -> Any:
        """Make TSID's task.

        Raises:
            InputError: TSID has none like it.
        """
        if isinstance(task, TrackingTask) and (
            task.ki is not None or task._gains.max_speed is not None
        ):
            raise InputError(f"the method tsid has neither ki nor max_speed, as {task.name!r} has")
        return self._model.task(task)

    def _touch(self, member: ContactMember) -> None:
        """Add a contact that has come, let one go that is to go."""
        contact, f = member.contact, self._formulation
        held, leaving = self._contacts.get(contact.name), member.target == 0.0
        if held is not None and held.leaving and not leaving:
            f.removeRigidContact(held.name, 0.0)
            held = None
        if held is None and not leaving:
            # TSID takes away by its name what has gone, at the end of the ramp and whatever came since.
            name = f"{contact.name} {len(self._kept)}"
            made = self._contact(contact, name)
            f.addRigidContact(made, FREE_FORCE if contact.force is None else WANTED_FORCE)
            held = self._contacts[contact.name] = _Held(made, name)
            self._kept.append(made)
        elif held is not None and leaving and not held.leaving:
            f.removeRigidContact(held.name, member.duration)
            held.leaving = True
        if held is not None and isinstance(contact, PointContact) and contact.force is not None:
            held.made.setForceReference(contact.surface @ contact.force)

    def _contact(self, contact: GroundContact, name: str) -> Any:
        """Make TSID's contact where the frame is now.

        Raises:
            InputError: TSID has none like it.
        """
        tsid, wrapper = self._model.tsid, self._model.wrapper
        frame, most = contact.frame, contact.max_force
        if contact.activation is not None:
            raise InputError(
                f"the method tsid has no activation of contacts, as {contact.name!r} has"
            )
        if isinstance(contact, SoleContact) and contact.force is None:
            x, y = contact.half
            corners = np.array([[x, x, -x, -x], [y, -y, y, -y], [0.0] * 4])
            corners += contact.offset[:, None]
            up = np.array([0.0, 0.0, 1.0])
            made = tsid.Contact6d(name, wrapper, frame, corners, up, contact.friction, 0.0, most)
        elif isinstance(contact, PointContact) and not np.any(contact.offset):
            made = tsid.ContactPoint(
                name, wrapper, frame, contact.normal, contact.friction, 0.0, most
            )
            made.useLocalFrame(False)
            made.setRegularizationTaskWeightVector(np.ones(3))
        else:
            raise InputError(f"the method tsid has no contact like {contact.name!r}")
        made.setKp(np.zeros(contact.rows))
        made.setKd(np.full(contact.rows, STILLING))
        here = wrapper.framePosition(self._formulation.data(), wrapper.model().getFrameId(frame))
        made.setReference(here)
        return made

    def _told(self, member: ContactMember, found: Any) -> ContactStatus:
        """Tell about one contact what the program has found."""
        contact, robot = member.contact, self._model.robot
        held = self._contacts.get(contact.name)
        terms = contact.evaluate(robot)
        there = 0.0 if held is None else 1.0
        force = np.zeros(contact.rows)
        if held is not None and self._formulation.checkContact(held.name, found):
            planned = np.array(self._formulation.getContactForce(held.name, found))
            if isinstance(contact, SoleContact):
                force = held.made.getForceGeneratorMatrix @ planned
                force[3:] -= np.cross(contact.offset, force[:3])
            else:
                force = terms.axes.T @ planned
        footing = Footing(member, terms, there, there)
        return contact_status(footing, contact.force_set(terms, there), force)

    def _joints(self, limits: JointLimits, period: float | None) -> Any:
        """Add what keeps joints inside their ranges and speeds."""
        n = self._model.robot.nv - 6
        lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
        speed, most = np.full(n, np.inf), np.full(n, np.inf)
        for side in limits.sides:
            k = side.index - 6
            (lower if side.sign < 0.0 else upper)[k] = side.limit
            speed[k], most[k] = side.speed, side.brake
        bounds = self._model.tsid.TaskJointPosVelAccBounds(
            "limits: joints", self._model.wrapper, period or TICK, False
        )
        bounds.setPositionBounds(lower, upper)
        bounds.setVelocityBounds(speed)
        bounds.setAccelerationBounds(most)
        bounds.setImposeBounds(True, True, True, False)
        self._formulation.addMotionTask(bounds, 1.0, HARD, 0.0)
        return bounds
