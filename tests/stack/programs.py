"""Random programs of requests, and a model of what they must lead to."""

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from opspace.errors import InputError, UnknownNameError

LEVELS = (-1.0, 0.0, 0.5, 1.0, 2.0)


@dataclass(frozen=True)
class Step:
    """One request: after how many ticks, what, with which tasks, where and how long."""

    wait: int
    kind: str
    first: int
    second: int
    level: float
    duration: float
    profile: str = "quintic"


KINDS = ("insert", "insert", "remove", "move", "move", "swap")
PROFILES = ("quintic", "cubic", "half-sine", "tanh")


def programs(shortest, longest, sizes=(4, 14), tasks=7):
    """Programs from seeds: hypothesis, left alone, prefers short ones with little overlap."""
    return st.builds(
        lambda seed, size: _program(np.random.default_rng(seed), size, shortest, longest, tasks),
        st.integers(0, 2**32 - 1),
        st.integers(*sizes),
    )


def _program(rng, size, shortest, longest, tasks):
    # Often the same few tasks, so that requests meet tasks on their way.
    favourites = rng.choice(tasks, 2)
    return [
        Step(
            wait=int(rng.integers(0, 8)),
            kind=str(rng.choice(KINDS)),
            first=int(rng.choice(favourites) if rng.random() < 0.5 else rng.integers(tasks)),
            second=int(rng.integers(tasks)),
            level=float(rng.choice(LEVELS)),
            duration=float(np.exp(rng.uniform(np.log(shortest), np.log(longest)))),
            profile=str(rng.choice(PROFILES)),
        )
        for _ in range(size)
    ]


class Program:
    """Plays steps to a stack at their ticks and knows which of them must be refused.

    ``levels`` holds the tasks that are to be in the stack in the end; ``here`` says which names
    are in it at the moment, leaving ones included. At most ``overlap`` transitions run at a time.
    """

    def __init__(self, stack, tasks, steps, initial, overlap=6):
        self.stack, self.tasks, self.overlap = stack, tasks, overlap
        self.levels = dict(initial)
        self.schedule = []
        tick = 1
        for step in steps:
            tick += step.wait
            self.schedule.append((tick, step))

    @property
    def done(self):
        return not self.schedule

    def play(self, tick, here, running):
        while self.schedule and self.schedule[0][0] <= tick:
            _, step = self.schedule.pop(0)
            if running >= self.overlap:
                continue
            running += 1
            here |= self._ask(step, here)

    def _ask(self, step, here):
        """Return the name of a task that has been inserted, as a set."""
        a, b = self.tasks[step.first], self.tasks[step.second]
        error = self._refusal(step, a, b, here)
        how = {"duration": step.duration, "profile": step.profile}
        ask = {
            "insert": lambda: self.stack.insert(a, step.level, **how),
            "remove": lambda: self.stack.remove(a.name, **how),
            "move": lambda: self.stack.move(a, step.level, **how),
            "swap": lambda: self.stack.swap(a, b.name, **how),
        }[step.kind]
        if error is not None:
            try:
                ask()
            except error:
                return set()
            raise AssertionError(f"{step} was accepted")
        ask()
        levels = self.levels
        if step.kind == "remove":
            levels.pop(a.name, None)
        elif step.kind == "swap":
            levels[a.name], levels[b.name] = levels[b.name], levels[a.name]
        else:
            levels[a.name] = step.level
        return {a.name} if step.kind == "insert" else set()

    def _refusal(self, step, a, b, here):
        inside = a.name in self.levels
        if step.kind == "insert":
            return InputError if inside and self.levels[a.name] != step.level else None
        if step.kind == "remove":
            return None if a.name in here else UnknownNameError
        if step.kind == "move":
            return None if inside else UnknownNameError
        if not (inside and b.name in self.levels):
            return UnknownNameError
        return InputError if a is b else None


def variables_of(members):
    """Every activation that goes by a ramp."""
    found = [m.presence for m in members]
    found += [p.arrival for m in members for p in m.places if p.arrival is not None]
    return list(dict.fromkeys(found))


def running_of(members, t):
    return sum(not variable.arrived(t) for variable in variables_of(members))
