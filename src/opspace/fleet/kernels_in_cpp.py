"""Kernels as C++: what numba compiles for one robot, said for a compiler of many.

Kernels are plain loops over arrays whose sizes a plan knows, with names for whole records; they make
no arrays and raise nothing. So each statement has one counterpart, and nothing about the law is
written once more. A function becomes a generic lambda, since Warp takes code inside functions only;
types and sizes are found out by the compiler.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Callable, Collection, Mapping
from types import FunctionType, MappingProxyType, ModuleType
from typing import Any, TypeAlias

from opspace.errors import InputError

OPERATORS: Mapping[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "/", ast.Mod: "%",
    ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^", ast.LShift: "<<", ast.RShift: ">>",
    ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
    ast.And: "&&", ast.Or: "||", ast.Not: "!", ast.USub: "-", ast.UAdd: "+", ast.Invert: "~",
}  # fmt: skip
FUNCTIONS = {
    "sqrt": "wp::sqrt", "sin": "wp::sin", "cos": "wp::cos", "tanh": "wp::tanh", "cosh": "wp::cosh",
    "atan2": "wp::atan2", "ceil": "wp::ceil", "pow": "power",
    "isfinite": "wp::isfinite", "isnan": "wp::isnan", "isinf": "wp::isinf",
}  # fmt: skip
"""What `math` and powers are there."""

PRELUDE = """\
static constexpr auto value = [](auto x) { return x; };
static constexpr auto smaller = [](auto a, auto b) { return b < a ? b : a; };
static constexpr auto larger = [](auto a, auto b) { return b > a ? b : a; };
static constexpr auto power = [](auto a, auto b) {
  return wp::pow(decltype(a * b)(a), decltype(a * b)(b));
};
"""
"""Smaller and larger answer as Python's do where a number is none; a power has the digits of both."""


def translate(
    root: Callable[..., Any],
    constants: Mapping[str, float],
    instead: Mapping[Callable[..., Any], Callable[..., Any]] = MappingProxyType({}),
    exact: Collection[str] = (),
) -> tuple[str, str]:
    """Write a kernel and whatever it calls as C++ lambdas, each after those that it calls.

    Args:
        root: The kernel, as numba has it or as plain Python.
        constants: Numbers that replace constants of the modules, by name.
        instead: Kernels that are called instead of others.
        exact: Modules whose own numbers have sixteen digits, as the arrays that they work in.

    Returns:
        The code, and the name of the kernel's lambda.

    Raises:
        InputError: A statement that has no counterpart.
    """
    found = _Program(constants, instead, exact)
    name = found.require(root)
    return PRELUDE + "\n".join(found.code), name


class _Program:
    """Lambdas in the order in which they are needed."""

    def __init__(
        self,
        constants: Mapping[str, float],
        instead: Mapping[Callable[..., Any], Callable[..., Any]],
        exact: Collection[str],
    ) -> None:
        self.constants = constants
        self.exact = exact
        self._instead = instead
        self.code: list[str] = []
        self._names: dict[Any, str] = {}

    def require(self, function: Any) -> str:
        """Translate a function unless that is done, and return its name."""
        function = self._instead.get(function, function)
        plain = getattr(function, "py_func", function)
        key = plain.__code__
        if key not in self._names:
            home = plain.__globals__.get("__name__", "").rpartition(".")[2]
            self._names[key] = f"{home}_{plain.__name__.strip('_')}"
            self.code.append(_Function(self, plain, self._names[key]).text())
        return self._names[key]


class _Function(ast.NodeVisitor):
    """One function on its way to C++.

    A name of Python belongs to the whole function, one of C++ to its block. Each is declared where it
    is first assigned if everything else about it is inside the same block, otherwise before the
    statement that has its first assignment, in the block that holds all.
    """

    def __init__(self, program: _Program, function: FunctionType, name: str) -> None:
        self._program = program
        self._globals = function.__globals__
        self._name = name
        exact = function.__globals__.get("__name__") in program.exact
        self._real = "double" if exact else "real"
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
        assert isinstance(tree, ast.FunctionDef)
        self._tree = tree
        self._parameters = [argument.arg for argument in tree.args.args]
        self._scopes = _Scopes(tree)
        self._lines: list[str] = []
        self._depth = 1
        self._count = 0

    def text(self) -> str:
        """Return the lambda."""
        given = ", ".join(f"auto {name}_" for name in self._parameters)
        self._block(self._tree.body)
        return "\n".join(
            [f"static constexpr auto {self._name} = []({given}) {{", *self._lines, "};"]
        )

    # --- Statements ------------------------------------------------------------------------------

    def _block(self, statements: list[ast.stmt]) -> None:
        for statement in statements:
            for name, kind in self._scopes.declared_before(statement):
                self._line(f"{self._type(kind)} {name}_{{}};")
            method = getattr(self, f"_{type(statement).__name__}", None)
            if method is None:
                raise self._refusal(statement)
            method(statement)

    def _inside(self, head: str, statements: list[ast.stmt], tail: str = "}") -> None:
        self._line(head)
        self._depth += 1
        self._block(statements)
        self._depth -= 1
        self._line(tail)

    def _line(self, text: str) -> None:
        self._lines.append("  " * self._depth + text)

    def _Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):
            self._line(f"{self._say(node.value)};")

    def _Return(self, node: ast.Return) -> None:
        self._line("return;" if node.value is None else f"return value({self._say(node.value)});")

    def _Break(self, node: ast.Break) -> None:
        del node
        self._line("break;")

    def _Continue(self, node: ast.Continue) -> None:
        del node
        self._line("continue;")

    def _If(self, node: ast.If) -> None:
        if not node.orelse:
            self._inside(f"if ({self._test(node.test)}) {{", node.body)
            return
        self._inside(f"if ({self._test(node.test)}) {{", node.body, "} else {")
        self._depth += 1
        self._block(node.orelse)
        self._depth -= 1
        self._line("}")

    def _While(self, node: ast.While) -> None:
        self._inside(f"while ({self._test(node.test)}) {{", node.body)

    def _For(self, node: ast.For) -> None:
        assert isinstance(node.target, ast.Name)
        name, given = f"{node.target.id}_", node.iter
        if isinstance(given, ast.Tuple):
            items = self._fresh("items")
            values = ", ".join(self._say(item) for item in given.elts)
            self._line(f"const I {items}[] = {{{values}}};")
            k = self._fresh("k")
            head = (
                f"for (I {k} = 0; {k} < {len(given.elts)}; ++{k}) {{ const I {name} = {items}[{k}];"
            )
            self._inside(head, node.body)
            return
        if not isinstance(given, ast.Call) or self._said(given.func) != "range":
            raise self._refusal(node)
        bounds = [self._say(bound) for bound in given.args]
        first, last = ("I(0)", bounds[0]) if len(bounds) == 1 else bounds[:2]
        step = bounds[2] if len(bounds) == 3 else "I(1)"
        backwards = len(bounds) == 3 and isinstance(given.args[2], ast.UnaryOp)
        end = self._fresh("end")
        less = ">" if backwards else "<"
        head = f"for (I {name} = {first}, {end} = {last}; {name} {less} {end}; {name} += {step}) {{"
        self._inside(head, node.body)

    def _AugAssign(self, node: ast.AugAssign) -> None:
        if type(node.op) not in OPERATORS:
            raise self._refusal(node)
        self._line(f"{self._say(node.target)} {OPERATORS[type(node.op)]}= {self._say(node.value)};")

    def _Assign(self, node: ast.Assign) -> None:
        if len(node.targets) > 1:
            value = self._fresh("value")
            self._line(f"auto {value} = value({self._say(node.value)});")
            for target in node.targets:
                self._store(target, value)
            return
        (target,) = node.targets
        if not isinstance(target, ast.Tuple):
            self._store(target, self._say(node.value), literal=self._literal(node.value))
        elif isinstance(node.value, ast.Tuple):
            self._store_each(target.elts, node.value.elts)
        else:
            value = self._fresh("several")
            self._line(f"auto {value} = {self._say(node.value)};")
            for i, one in enumerate(target.elts):
                self._store(one, f"wp::extract<{i}>({value})")

    def _store_each(self, targets: list[ast.expr], values: list[ast.expr]) -> None:
        """Assign all at once: no value may see what another target has got already."""
        if all(isinstance(t, ast.Name) and self._scopes.declares(t) for t in targets):
            for target, value in zip(targets, values, strict=True):
                self._store(target, self._say(value), literal=self._literal(value))
            return
        kept = [self._fresh("kept") for _ in values]
        for name, value in zip(kept, values, strict=True):
            self._line(f"auto {name} = value({self._say(value)});")
        for target, name in zip(targets, kept, strict=True):
            self._store(target, name)

    def _store(self, target: ast.expr, value: str, literal: str = "auto") -> None:
        if isinstance(target, ast.Name) and self._scopes.declares(target):
            self._line(f"{literal} {target.id}_ = value({value});")
        else:
            self._line(f"{self._say(target)} = {value};")

    def _test(self, node: ast.expr) -> str:
        """Say a condition; compilers take a second pair of parentheses around one for a mistake."""
        said = self._say(node)
        alone = isinstance(node, ast.Compare) and len(node.ops) == 1
        return said[1:-1] if alone else said

    # --- Expressions -----------------------------------------------------------------------------

    def _say(self, node: ast.expr) -> str:
        method = getattr(self, f"_say_{type(node).__name__}", None)
        if method is None:
            raise self._refusal(node)
        return method(node)

    def _say_Constant(self, node: ast.Constant) -> str:
        return _number(node.value, self._real)

    def _say_Name(self, node: ast.Name) -> str:
        if node.id in self._parameters or self._scopes.knows(node.id):
            return f"{node.id}_"
        if node.id in self._program.constants:
            return _number(self._program.constants[node.id], self._real)
        found = self._globals.get(node.id)
        if not isinstance(found, int | float):
            raise self._refusal(node)
        return _number(found, self._real)

    def _say_Attribute(self, node: ast.Attribute) -> str:
        if isinstance(node.value, ast.Name) and self._globals.get(node.value.id) is math:
            return _number(getattr(math, node.attr), self._real)
        return f"{self._say(node.value)}.{node.attr}_()"

    def _say_Subscript(self, node: ast.Subscript) -> str:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            assert isinstance(node.slice, ast.Constant)
            return f"I({self._say(node.value.value)}.n{node.slice.value}())"
        array = self._say(node.value)
        if isinstance(node.slice, ast.Slice):
            assert node.slice.lower is not None
            return f"{array}.from({self._say(node.slice.lower)})"
        places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if isinstance(places[0], ast.Slice):
            return f"{array}.column({self._say(places[1])})"
        return f"{array}({', '.join(self._say(place) for place in places)})"

    def _say_BinOp(self, node: ast.BinOp) -> str:
        if isinstance(node.op, ast.Pow):
            return self._power(node)
        return f"({self._say(node.left)} {OPERATORS[type(node.op)]} {self._say(node.right)})"

    def _power(self, node: ast.BinOp) -> str:
        base, exponent = self._say(node.left), node.right
        if isinstance(exponent, ast.Constant) and isinstance(exponent.value, int):
            return "(" + " * ".join([base] * exponent.value) + ")"
        return f"{FUNCTIONS['pow']}({base}, {self._say(exponent)})"

    def _say_UnaryOp(self, node: ast.UnaryOp) -> str:
        return f"({OPERATORS[type(node.op)]}{self._say(node.operand)})"

    def _say_BoolOp(self, node: ast.BoolOp) -> str:
        sign = f" {OPERATORS[type(node.op)]} "
        return f"({sign.join(self._say(value) for value in node.values)})"

    def _say_Compare(self, node: ast.Compare) -> str:
        terms = [node.left, *node.comparators]
        pairs = [
            f"({self._say(a)} {OPERATORS[type(sign)]} {self._say(b)})"
            for a, sign, b in zip(terms[:-1], node.ops, terms[1:], strict=True)
        ]
        return pairs[0] if len(pairs) == 1 else f"({' && '.join(pairs)})"

    def _say_IfExp(self, node: ast.IfExp) -> str:
        return f"({self._say(node.test)} ? {self._say(node.body)} : {self._say(node.orelse)})"

    def _say_Tuple(self, node: ast.Tuple) -> str:
        return f"wp::tuple({', '.join(f'value({self._say(item)})' for item in node.elts)})"

    def _say__Part(self, node: _Part) -> str:
        return f"wp::extract<{node.i}>({self._say(node.whole)})"

    def _say_Call(self, node: ast.Call) -> str:
        given = [self._say(argument) for argument in node.args]
        if node.keywords:
            raise self._refusal(node)
        return f"{self._called(node.func)}({', '.join(given)})"

    def _called(self, function: ast.expr) -> str:
        name = self._said(function)
        built_in = {
            "min": "smaller",
            "max": "larger",
            "abs": "wp::abs",
            "int": "I",
            "float": self._real,
        }
        if name in built_in:
            return built_in[name]
        home, _, last = name.rpartition(".")
        found = self._globals.get(home or last)
        if isinstance(found, ModuleType):
            if found is math and last in FUNCTIONS:
                return FUNCTIONS[last]
            found = getattr(found, last, None)
        if not callable(found):
            raise self._refusal(function)
        return self._program.require(found)

    # --- Types -----------------------------------------------------------------------------------

    def _literal(self, node: ast.expr) -> str:
        """Return the type of a variable that begins as a literal."""
        kinds = {bool: "bool", int: "I", float: self._real}
        return kinds.get(type(node.value), "auto") if isinstance(node, ast.Constant) else "auto"

    def _type(self, node: ast.expr) -> str:
        """Return the type of what a variable is first assigned."""
        known = self._literal(node)
        return known if known != "auto" else f"decltype(value({self._say(node)}))"

    def _said(self, node: ast.expr) -> str:
        return ast.unparse(node)

    def _fresh(self, name: str) -> str:
        self._count += 1
        return f"{name}{self._count}"

    def _refusal(self, node: ast.AST) -> InputError:
        return InputError(
            f"kernel {self._name}, line {getattr(node, 'lineno', 0)}: {ast.unparse(node)!r} has no "
            "counterpart in a fleet"
        )


Path: TypeAlias = tuple[int, ...]
Occurrence: TypeAlias = tuple[Path, ast.Name, ast.stmt]
"""The block that a name is in, the name, and its statement."""


class _Scopes(ast.NodeVisitor):
    """Where each name of a function is declared."""

    def __init__(self, tree: ast.FunctionDef) -> None:
        parameters = {argument.arg for argument in tree.args.args}
        self._seen: dict[str, list[Occurrence]] = {}
        self._values: dict[int, ast.expr] = {}
        self._loops: list[str] = []
        self._statements: dict[Path, list[ast.stmt]] = {}
        self._all: set[str] = set()
        self._walk(tree.body, ())
        self._here: set[int] = set()
        self._before: dict[int, list[tuple[str, ast.expr]]] = {}
        for name, places in self._seen.items():
            if name not in parameters and any(isinstance(n.ctx, ast.Store) for _, n, _ in places):
                self._place(name, places)

    def knows(self, name: str) -> bool:
        """Tell whether a name is a variable of the function."""
        return name in self._all

    def declares(self, node: ast.Name) -> bool:
        """Tell whether this assignment is where its name is declared."""
        return id(node) in self._here

    def declared_before(self, statement: ast.stmt) -> list[tuple[str, ast.expr]]:
        """List what is to be declared before a statement, each with what it is first assigned."""
        return self._before.get(id(statement), [])

    def _walk(self, body: list[ast.stmt], path: Path) -> None:
        for statement in body:
            self._statements.setdefault(path, []).append(statement)
            if isinstance(statement, ast.For):
                assert isinstance(statement.target, ast.Name)
                self._note(statement.iter, path, statement)
                self._all.add(statement.target.id)
                self._loops.append(statement.target.id)
                self._walk(statement.body, (*path, id(statement.body)))
                self._loops.pop()
            elif isinstance(statement, ast.If | ast.While):
                self._note(statement.test, path, statement)
                self._walk(statement.body, (*path, id(statement.body)))
                self._walk(statement.orelse, (*path, id(statement.orelse)))
            else:
                self._note(statement, path, statement)

    def _note(self, node: ast.AST, path: Path, statement: ast.stmt) -> None:
        if isinstance(node, ast.Assign):
            self._note(node.value, path, statement)
            for target in node.targets:
                self._pair(target, node.value)
                self._note(target, path, statement)
            return
        for name in ast.walk(node):
            if isinstance(name, ast.Name) and name.id not in self._loops:
                self._seen.setdefault(name.id, []).append((path, name, statement))
                if isinstance(name.ctx, ast.Store):
                    self._all.add(name.id)

    def _pair(self, target: ast.expr, value: ast.expr) -> None:
        """Remember what each name is assigned."""
        if isinstance(target, ast.Name):
            self._values[id(target)] = value
        elif isinstance(target, ast.Tuple):
            for i, one in enumerate(target.elts):
                part = value.elts[i] if isinstance(value, ast.Tuple) else _Part(value, i)
                self._pair(one, part)

    def _place(self, name: str, places: list[Occurrence]) -> None:
        """Declare a name; loops that each have one of their own declare it each."""
        common = places[0][0]
        for path, _, _ in places:
            while path[: len(common)] != common:
                common = common[:-1]
        groups = self._groups(common, places)
        # Where nothing depends on what the name stood for before.
        fresh = [True] * (len(groups) + 1)
        alone = [all(path != common for path, _, _ in group) for group in groups]
        for k in reversed(range(len(groups))):
            begins = [isinstance(b[0][1].ctx, ast.Store) for b in _branches(common, groups[k])]
            fresh[k] = all(begins) and (not alone[k] or fresh[k + 1])
        for k, group in enumerate(groups):
            if not (alone[k] and fresh[k]):
                self._declare(name, common, [place for group in groups[k:] for place in group])
                return
            for branch in _branches(common, group):
                self._place(name, branch)

    def _declare(self, name: str, block: Path, places: list[Occurrence]) -> None:
        """Declare a name in a block, with the first of these places or before it."""
        path, first, statement = next(p for p in places if isinstance(p[1].ctx, ast.Store))
        if path == block and not isinstance(statement, ast.AugAssign):
            self._here.add(id(first))
            return
        holder = next(s for s in self._statements[block] if _holds(s, first))
        self._before.setdefault(id(holder), []).append((name, self._values[id(first)]))

    def _groups(self, block: Path, places: list[Occurrence]) -> list[list[Occurrence]]:
        """Sort places by the statements of a block that hold them."""
        found: list[list[Occurrence]] = []
        for statement in self._statements[block]:
            held = {id(node) for node in ast.walk(statement)}
            group = [place for place in places if id(place[1]) in held]
            if group:
                found.append(group)
        return found


def _branches(block: Path, places: list[Occurrence]) -> list[list[Occurrence]]:
    """Sort what is in one statement of a block by the blocks inside it, in order."""
    found: dict[Path, list[Occurrence]] = {}
    for place in places:
        found.setdefault(place[0][: len(block) + 1], []).append(place)
    return list(found.values())


class _Part(ast.expr):
    """One of several values of an expression."""

    def __init__(self, whole: ast.expr, i: int) -> None:
        super().__init__()
        self.whole, self.i = whole, i


def _holds(statement: ast.stmt, node: ast.AST) -> bool:
    return any(one is node for one in ast.walk(statement))


def _number(value: Any, real: str) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return f"I({int(value)})"
    if isinstance(value, float):
        if math.isinf(value):
            return f"{real}(INFINITY)" if value > 0.0 else f"(-{real}(INFINITY))"
        return f"{real}({value!r})"
    raise InputError(f"{value!r} is no number")
