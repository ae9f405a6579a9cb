"""One tick as a list of named stages, the same names as in `opspace.kernels.tick`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from opspace.command import Found, Status
from opspace.controller.bounds import Bounds, Kept, change_within_tick, metric_of, realise
from opspace.controller.collisions import DistanceTerms, distance_terms
from opspace.controller.contact_stages import (
    Footing,
    contact_task_sets,
    evaluate_contacts,
    stand,
)
from opspace.controller.disturbance import DisturbanceObserver
from opspace.controller.drivable import joint_positions
from opspace.controller.limit_task_sets import (
    LimitTerms,
    braking,
    limit_task_sets,
    limit_terms,
)
from opspace.controller.reference_report import level_status, task_status
from opspace.errors import ByName, InputError
from opspace.law import (
    LawInfo,
    Motors,
    SigmaBuffer,
    Stacks,
    TaskSet,
    Weighted,
    blended_torque,
    corners,
    levels_of,
    whiten,
)
from opspace.law.blending import combined
from opspace.law.contact_forces import ForceSet, Realised, Room, Wish
from opspace.law.contact_forces import realise as nearest_with_forces
from opspace.law.scalars import LOOKS, SCALED, SEEN, room_for, unrest_of
from opspace.plan.scales import Scales
from opspace.robots.adapter import spread_of
from opspace.robots.protocol import Robot
from opspace.stack import (
    Blending,
    ContactMember,
    Member,
    Mixture,
    UnrestMemory,
    mixture,
    presences,
)
from opspace.tasks import JointLimits, PostureTask, TaskTerms, TrackingTask
from opspace.tasks.activations import own_activation
from opspace.tasks.collision_avoidance import CollisionAvoidance
from opspace.tasks.obstacles import NO_PLACINGS, Placing
from opspace.tasks.validation import shown

REST = ""
"""Name of the damping of what no task uses; tasks have names."""


class Question(NamedTuple):
    """What a law is asked in one tick.

    Attributes:
        L: (n, n) lower Cholesky factor of the inertia.
        task_sets: Every task set that is in some corner, fully active: joint limits with the priority
            −1, tasks with the rank of their level, damping of the rest with the last rank.
        corners: Stacks as indices into ``task_sets``, with weights that sum to 1.
        levels: Numbers of the levels by their rank.
        buffer: Where singular directions fade; None for nowhere.
        motors: Torque limits to stay inside of; None where they are not asked.
        motion: (n,) whitened velocity Lᵀ q̇, √J.
    """

    L: np.ndarray
    task_sets: Sequence[TaskSet]
    corners: Sequence[Weighted]
    levels: Sequence[float]
    buffer: SigmaBuffer | None
    motors: Motors | None
    motion: np.ndarray


Law = Callable[[Question], tuple[np.ndarray, LawInfo]]
"""A torque (n,), N·m, beside the bias and beside what ``motors`` starts with, and what it took."""

Realisation = Callable[[Wish, Sequence[ForceSet], Room], Realised]
"""What a robot on contacts does of what the law wants, see `opspace.law.contact_forces.realise`."""


def sum_of_hard_torques(asked: Question) -> tuple[np.ndarray, LawInfo]:
    """Γ = Σ_T w_T H(T; f̃), the library's own law (Eq. 19-23)."""
    L, task_sets, blend, _, buffer, motors, motion = asked
    return blended_torque(
        L, task_sets, blend, buffer, want_spectra=True, motors=motors, motion=motion
    )


@dataclass(frozen=True)
class Rules:
    """What is the same in every tick, but for what ``blending``, ``observer`` and ``unrest`` remember.

    Attributes:
        law: Torque of task sets.
        blending: Stacks between which tasks are on their way.
        bias: See `opspace.controller.reference.BIASES`.
        damping: Of the motions that no task uses, 1/s.
        keep_torque: Whether levels give way to the motors' limits.
        scales: References of σ.
        limits: Joint limits, None for none.
        observer: Of what the model does not explain; None trusts the model.
        period: Time between two ticks, in which accelerations change, s; 0 where it is not known.
        guard: What is kept apart, None for nothing.
        unrest: How far tasks were from rest lately.
        realise: What a robot on contacts does of what the law wants.
    """

    law: Law
    blending: Blending
    bias: str
    damping: float
    keep_torque: bool
    scales: Scales
    limits: JointLimits | None
    observer: DisturbanceObserver | None
    period: float
    guard: CollisionAvoidance | None = None
    unrest: UnrestMemory = field(default_factory=UnrestMemory)
    realise: Realisation = nearest_with_forces


@dataclass(frozen=True)
class Given:
    """What one tick begins with; the stages read it and change nothing.

    Attributes:
        rules: What is the same in every tick.
        t: Time, s.
        members: The tasks.
        robot: The robot, updated.
        q: Configuration, (nq,).
        v: (n,) velocity, rad/s.
        M: (n, n) inertia.
        bias: (n,) Coriolis, centrifugal and gravity torque without the middle of what the motors give,
            N·m, with the reaction from `balance` on.
        torque_limit: (n,) what the motors give to both sides of its middle, N·m.
        torque_middle: (n,) the middle, N·m; no torque of the tick has it in it but the last one.
        reaction: (n,) what tasks expect of the world, N·m; None for nothing.
        part: How much of it the motors can give.
        base: Number of the first coordinates without a motor, those of a floating base.
        contacts: What a robot with such a base touches.
    """

    rules: Rules
    t: float
    members: Sequence[Member]
    robot: Robot
    q: np.ndarray
    v: np.ndarray
    M: np.ndarray
    bias: np.ndarray
    torque_limit: np.ndarray
    torque_middle: np.ndarray
    reaction: np.ndarray | None = None
    part: float = 1.0
    base: int = 0
    contacts: Sequence[ContactMember] = ()


class Blend(NamedTuple):
    """Task sets, and the stacks that are mixed of them as indices with weights."""

    task_sets: Sequence[TaskSet]
    corners: Sequence[Weighted]


class Answer(NamedTuple):
    """Torque (n,), N·m, what happened, the number of hard torques and what there is to report.

    ``hindrance`` is what the contacts could not carry, see `opspace.stack.ContactMember.advance`;
    ``placings`` is where obstacles were found.
    """

    tau: np.ndarray
    status: Status
    hard_solves: int
    found: Found
    hindrance: float = 0.0
    placings: Mapping[str, Placing] = NO_PLACINGS


def tick(k: Given) -> Answer | None:
    """Compute the torque, or None where the model or its numbers cannot be computed with.

    Raises:
        InputError: A reference, an activation or a task of the user's own gave unusable numbers.
    """
    h = activations(k)
    terms = evaluate_tasks(k)
    k = balance(k, h, terms)
    mixed = blend(k, h)
    L = factor(k, terms)
    if L is None:
        return None
    tasks = whiten_tasks(k, h, terms, mixed, L)
    limits = begin_limits(k)
    inserted = insert_limits(k)
    touches = evaluate_contacts(k)
    above = on_the_ground(k, touches, limit_corners(k, limits, inserted))
    try:
        gamma, info = law(k, L, mixed, tasks, above)
        distances = measure_distances(k)
        if k.base:
            metric = metric_of(without_rest(L, tasks), k.v.size)
            kept = stand(k, L, limits, touches, distances, metric, gamma)
        else:
            kept = keep_bounds(k, L, limits, distances, tasks, torque(k, gamma))
    except (InputError, np.linalg.LinAlgError):
        # Everything that went in is finite: these numbers are too large to compute with.
        return None
    active = {limits[i].side.name: limit for i, limit in inserted.items()} | dict(kept.limits)
    levels = level_status(k.members, mixed, info, len(above.task_sets))
    apart = (
        ByName() if distances is None else distances.layout.status(distances.distance, kept.taken)
    )
    told = task_status(k.members, h, terms, mixed)
    found = Found(told, levels, active, apart, ByName(kept.contacts))
    happened = status(k, kept.tau, info, found) | kept.status
    placings = NO_PLACINGS if distances is None else distances.by_name
    return Answer(
        kept.tau + k.torque_middle, happened, info.hard_solves, found, kept.hindrance, placings
    )


def activations(k: Given) -> list[float]:
    """Presence in the stack times the task's own activation."""
    found: list[float] = []
    for member, h in zip(k.members, presences(k.members, k.t), strict=True):
        if member.task.activation is not None:
            found.append(h * own_activation(member.task, k.robot, k.t))
        else:
            found.append(h)
    return found


def evaluate_tasks(k: Given) -> list[TaskTerms]:
    """J, J̇ q̇ and f* of every task (Eq. 24)."""
    return [member.task.evaluate(k.robot, k.t) for member in k.members]


def balance(k: Given, h: Sequence[float], terms: Sequence[TaskTerms]) -> Given:
    """Count s Σ h_k g_k as bias, with s as far as the motors can give it.

    The weights of the stacks that have task k sum to h_k, so this is what the blend of stacks that
    each carry the torques of their own tasks comes to.

    Raises:
        InputError: A task of the user's own gave an unusable torque.
    """
    carried = [
        activation * _balanced(k, member, term.torque)
        for member, activation, term in zip(k.members, h, terms, strict=True)
        if term.torque is not None
    ]
    if not carried:
        return k
    reaction = np.add.reduce(carried)
    part = 1.0
    # On the ground the motors' limits act behind the law, together with those of the forces.
    if k.rules.keep_torque and k.rules.bias == "joint" and not k.base:
        part = room_for(reaction, start_inside(k), k.torque_limit)
        reaction = part * reaction
    return replace(k, bias=k.bias + reaction, reaction=reaction, part=part)


def _balanced(k: Given, member: Member, torque: np.ndarray) -> np.ndarray:
    found = np.asarray(torque, dtype=float)
    if found.shape != k.v.shape or not np.all(np.isfinite(found)):
        raise InputError(
            f"task {member.task.name!r}: its balanced torque at t = {k.t:.6g} s must be finite, of "
            f"shape {k.v.shape}, got {shown(torque)}"
        )
    return found


def blend(k: Given, h: Sequence[float]) -> Mixture:
    """Hard stacks between which the tasks are on their way, with their weights w_T."""
    return mixture(k.members, h, k.t, k.rules.blending)


def factor(k: Given, terms: Sequence[TaskTerms]) -> np.ndarray | None:
    """A = L Lᵀ; None where the model or a task of the library is not finite, or A no inertia."""
    numbers = [k.M, k.bias]
    for member, term in zip(k.members, terms, strict=True):
        if isinstance(member.task, TrackingTask):
            numbers += [term.J, term.drift, term.acceleration]
    if not all(np.isfinite(array).all() for array in numbers):
        return None
    try:
        return np.linalg.cholesky(k.M) if np.linalg.eigvalsh(k.M)[0] > 0.0 else None
    except np.linalg.LinAlgError:
        return None


def whiten_tasks(
    k: Given, h: Sequence[float], terms: Sequence[TaskTerms], mixed: Mixture, L: np.ndarray
) -> Blend:
    """J q̈ = f̃ for every task, f̃ = f* − J̇ q̇ (Eq. 3), and damping of what is left.

    What is whitened is left to the law, which does it to all rows at once.
    """
    members, rules = k.members, k.rules
    rank = {level: i for i, level in enumerate(mixed.levels)}
    references = rules.scales.references([members[i].task for i, _ in mixed.slots])
    unrest = unrest_of_tasks(k, h, terms, float(np.linalg.norm(L.T @ k.v)))
    fade = h if rules.blending.fades_commands else [1.0] * len(h)
    sets = [
        TaskSet(
            terms[i].J,
            fade[i] * terms[i].acceleration - terms[i].drift,
            rank[level],
            1.0,
            members[i].task.name,
            reference,
            unrest[i],
        )
        for (i, level), reference in zip(mixed.slots, references, strict=True)
    ]
    covered = any(
        isinstance(member.task, PostureTask) and member.task.rows == k.v.size and present == 1.0
        for member, present in zip(members, h, strict=True)
    )
    if covered or rules.damping == 0.0:
        return Blend(sets, mixed.corners)
    # q̈ = −d v of what is left, weighed by the inertia: its momentum decays at the rate d. A
    # posture on its way in takes everything away from it, so it need not fade.
    rest = -rules.damping * (L.T @ k.v)
    sets.append(TaskSet(L.T, rest, len(rank), 1.0, REST, rules.scales.unit))
    last = len(sets) - 1
    return Blend(sets, [Weighted(w, present | {last}) for w, present in mixed.corners])


def unrest_of_tasks(
    k: Given, h: Sequence[float], terms: Sequence[TaskTerms], speed: float
) -> list[float]:
    """How far every task has lately been from rest at its target, with ``speed`` = ‖Lᵀ q̇‖, √J."""
    scales = k.rules.scales
    if not scales.know_rest:
        return [1.0] * len(k.members)
    near = [scales.near(member.task) for member in k.members]
    now: list[np.ndarray] = []
    for member, each, term in zip(k.members, near, terms, strict=True):
        rows = zip(each, term.error, scales.reference(member.task), strict=True)
        now.append(np.sqrt([unrest_of(e, x, speed, usual) for e, x, usual in rows]))
    lately = k.rules.unrest.after(k.t, k.members, h, now)
    found = zip(near, lately, strict=True)
    return [float(np.linalg.norm(np.where(e > 0.0, m, 1.0))) for e, m in found]


def law(
    k: Given, L: np.ndarray, mixed: Mixture, tasks: Blend, limits: Blend
) -> tuple[np.ndarray, LawInfo]:
    """Γ_tasks of the stacks, under the joint limits that take part (Eq. 20, Eq. 23)."""
    rules = k.rules
    sets = [*limits.task_sets, *tasks.task_sets]
    if rules.bias == "task":
        # Eq. 3-4: f̃ = f* + η + ζ, the bias as an acceleration of each task.
        drop = np.linalg.solve(k.M, k.bias + k.torque_middle)
        sets = [task.replace(f=task.f + task.J @ drop) for task in sets]
    first = len(limits.task_sets)
    shifted = [Weighted(w, frozenset(first + i for i in here)) for w, here in tasks.corners]
    everything = combined(limits.corners, shifted)
    # On the ground the motors' limits act behind the law, together with those of the forces.
    scales = rules.keep_torque and not k.base
    motors = Motors(L, start_inside(k), k.torque_limit) if scales else None
    buffer, motion = rules.scales.buffer, L.T @ k.v
    return rules.law(Question(L, sets, everything, mixed.levels, buffer, motors, motion))


def beside_tasks(k: Given) -> np.ndarray:
    """Give the torque that is there before any task acts, (n,) N·m."""
    return -k.torque_middle if k.rules.bias == "task" else k.bias


def start_inside(k: Given) -> np.ndarray:
    """Begin with the bias where it is compensated at every joint, cut at the motors' limits."""
    return np.clip(beside_tasks(k), -k.torque_limit, k.torque_limit)


def begin_limits(k: Given) -> list[LimitTerms]:
    """q̈_adm of every joint limit, without what the model does not explain."""
    limits, observer = k.rules.limits, k.rules.observer
    if limits is None:
        return []
    if observer is not None:
        observer.observe(k.t, k.v)
    most = braking(k.M, k.bias, k.torque_limit)
    at = joint_positions(k.robot)
    return limit_terms(limits, at, k.v, most, k.rules.period, observer and observer.acceleration)


def insert_limits(k: Given) -> dict[int, float]:
    """Activation of the limits that take part as task sets, by index (Fig. 7)."""
    limits = k.rules.limits
    found = [] if limits is None else limits.presences(joint_positions(k.robot), k.v)
    return {i: h for i, h in enumerate(found) if h > 0.0}


def limit_corners(k: Given, limits: Sequence[LimitTerms], inserted: Mapping[int, float]) -> Blend:
    """Task sets of the limits that take part, and the corners of their chain.

    Many joints can be near a limit at once: m + 1 corners for m of them, not 2^m.
    """
    sets = limit_task_sets(limits, inserted, k.v.size, k.rules.scales.joint)
    return Blend(sets, corners([task.activation for task in sets], "chain"))


def on_the_ground(k: Given, touches: Sequence[Footing], limits: Blend) -> Blend:
    """Put what contacts hold above the joint limits."""
    sets = contact_task_sets(touches)
    if not sets:
        return limits
    first = len(sets)
    shifted = [Weighted(w, frozenset(first + i for i in here)) for w, here in limits.corners]
    closing = corners([touch.motion for touch in touches if touch.motion > 0.0], "chain")
    return Blend([*sets, *limits.task_sets], combined(closing, shifted))


def torque(k: Given, gamma: np.ndarray) -> np.ndarray:
    """Γ = Γ_tasks + b + g (Eq. 4), the bias as far as the motors give it."""
    if k.rules.keep_torque:
        return start_inside(k) + gamma
    return gamma + beside_tasks(k)


def measure_distances(k: Given) -> DistanceTerms | None:
    """How far bodies are apart that must not touch, and how fast each distance may shrink."""
    guard = k.rules.guard
    return None if guard is None else distance_terms(guard, k.robot, k.t, k.torque_limit)


def keep_bounds(
    k: Given,
    L: np.ndarray,
    limits: Sequence[LimitTerms],
    distances: DistanceTerms | None,
    tasks: Blend,
    tau: np.ndarray,
) -> Kept:
    """Take the nearest torque with which no joint, motor or distance does more than it may."""
    rules, observer = k.rules, k.rules.observer
    kept = Kept(tau)
    keeps = limits if rules.limits is not None and rules.limits.law.bound else []
    if keeps or rules.keep_torque or distances is not None:
        room = k.torque_limit if rules.keep_torque else np.full(k.v.size, np.inf)
        bounds = Bounds(keeps, k.M, k.bias, room, distances)
        kept = realise(bounds, tau, lambda: without_rest(L, tasks))
        if keeps and looks_ahead(k):
            kept = look_through(k, bounds, tau, kept, lambda: without_rest(L, tasks))
    if observer is not None:
        observer.remember(k.t, k.v, np.linalg.solve(k.M, kept.tau - k.bias))
    return kept


def looks_ahead(k: Given) -> bool:
    """Tell whether the change of accelerations within a tick counts: not with joints that follow."""
    return k.rules.period > 0.0 and k.q.size == k.v.size and spread_of(k.robot) is None


def look_through(
    k: Given, bounds: Bounds, tau: np.ndarray, kept: Kept, stacks: Callable[[], Stacks]
) -> Kept:
    """Keep the bounds of the mean acceleration, that of the middle of the tick."""
    taken_off = np.zeros(len(bounds.terms))
    for _ in range(LOOKS):
        more = bounds.more(middle(k, kept)[1])
        if np.all(np.abs(more - taken_off) <= SEEN * np.maximum(1.0, more)):
            return kept
        taken_off = more
        kept = realise(bounds.after(more), tau, stacks)
        if Status.FILTERED not in kept.status:
            return kept
    acceleration, change = middle(k, kept)
    if bounds.passed(acceleration + change):
        return kept._replace(status=kept.status | Status.LIMIT_LOST)
    return kept


def middle(k: Given, kept: Kept) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations at the beginning of the tick, and their change until its middle, (n,) rad/s²."""
    acceleration = np.linalg.solve(k.M, kept.tau - k.bias)
    own = kept.tau if k.reaction is None else kept.tau - k.reaction
    change = change_within_tick(k.robot, own + k.torque_middle, acceleration, k.rules.period)
    return acceleration, change


def without_rest(L: np.ndarray, tasks: Blend) -> Stacks:
    """Tell what is mixed, damping of the rest apart; its task set is the last."""
    sets = [task for task in tasks.task_sets if task.name != REST]
    here = frozenset(range(len(sets)))
    blend = [Weighted(weight, present & here) for weight, present in tasks.corners]
    names, damped = [task.name for task in sets], len(sets) < len(tasks.task_sets)
    return Stacks(whiten(sets, L), levels_of(sets), blend, names, damped)


def status(k: Given, tau: np.ndarray, info: LawInfo, found: Found) -> Status:
    """What happened."""
    bits = Status.OK
    if not np.all(np.isfinite(tau)):
        bits |= Status.FAULT
    elif np.any(np.abs(tau) > k.torque_limit):
        bits |= Status.ABOVE_TORQUE_LIMIT
    if found.limits:
        bits |= Status.JOINT_LIMIT
    if k.part < 1.0 - SCALED or any(level.scale < 1.0 - SCALED for level in info.levels):
        bits |= Status.TORQUE_SCALED
    if any(np.any(level.activation < 1.0) for level in found.levels):
        bits |= Status.DIRECTION_OFF
    return bits
