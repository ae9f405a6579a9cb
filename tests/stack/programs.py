"""Random programs of requests, and a model of what they must lead to."""

from dataclasses import dataclass

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


def programs(durations, waits=(0, 12), tasks=7, sizes=(4, 14)):
    step = st.builds(
        Step,
        wait=st.integers(*waits),
        kind=st.sampled_from(["insert", "insert", "remove", "move", "swap"]),
        first=st.integers(0, tasks - 1),
        second=st.integers(0, tasks - 1),
        level=st.sampled_from(LEVELS),
        duration=durations,
        profile=st.sampled_from(["quintic", "cubic", "half-sine", "tanh"]),
    )
    return st.lists(step, min_size=sizes[0], max_size=sizes[1])


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
