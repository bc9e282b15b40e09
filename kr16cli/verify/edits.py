"""Edits of source text: every operator, sign, index and constant, changed one by one.

Annotations, texts, imports and `strict=` are left alone: they compute nothing.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass

_OPERATORS: dict[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.Mod: ("%", "//"),
    ast.FloorDiv: ("//", "%"),
    ast.Pow: ("**", "*"),
    ast.BitOr: ("|", "&"),
    ast.BitAnd: ("&", "|"),
    ast.LShift: ("<<", ">>"),
    ast.RShift: (">>", "<<"),
}
_COMPARISONS: dict[type[ast.cmpop], tuple[str, tuple[str, ...]]] = {
    ast.Lt: ("<", (">=", "<=")),
    ast.LtE: ("<=", (">", "<")),
    ast.Gt: (">", ("<=", ">=")),
    ast.GtE: (">=", ("<", ">")),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
    ast.Is: ("is", ("is not",)),
    ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)),
    ast.NotIn: ("not in", ("in",)),
}
_ORDERED = {"cross": (0, 1), "sub": (0, 1), "atan2": (0, 1), "where": (1, 2)}
"""Functions whose arguments have an order, and the two to swap."""
_TWINS = {"cos": "sin", "sin": "cos", "turn_in": "turn_out", "turn_out": "turn_in"}
_SCALAR = (
    "sqrt", "atan2", "sin", "cos", "where", "dot", "sum_of", "principal", "turned_back",
    "wrist_factor", "elbow_factor", "shoulder_factor",
)  # fmt: skip
_BOUNDS = (ast.Compare, ast.BoolOp)


@dataclass(frozen=True)
class Edit:
    """A stretch of source text, from `start` to before `end`, and what replaces it."""

    start: int
    end: int
    text: str
    kind: str


def edits(text: str, tree: ast.Module) -> list[Edit]:
    """All edits of a file, in the order of the text."""
    return _Edits(text, tree).found()


class _Edits(ast.NodeVisitor):
    """Collects the edits of a file."""

    def __init__(self, text: str, tree: ast.Module) -> None:
        self.text = text
        self.tree = tree
        self.starts = [0]
        for line in text.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))
        self.edits: dict[Edit, None] = {}

    def found(self) -> list[Edit]:
        """All edits in the order of the text."""
        self.visit(self.tree)
        return sorted(self.edits, key=lambda e: (e.start, e.end, e.text))

    # What computes nothing is not visited.
    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self._value(node.value)

    def visit_arg(self, node: ast.arg) -> None:
        pass

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        for part in (*node.args.defaults, *node.body):
            self.visit(part)

    def visit_keyword(self, node: ast.keyword) -> None:
        if node.arg != "strict":
            self.visit(node.value)

    def visit_Assign(self, node: ast.Assign) -> None:
        if not _names_types(node.value):
            self._value(node.value)
            for target in node.targets:
                self.visit(target)

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None:
            self._value(node.value)

    def _value(self, node: ast.expr) -> None:
        """Negate the terms of what is assigned or returned; then look inside."""
        self._negate_terms(node)
        self.visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        old, new = _OPERATORS[type(node.op)]
        self._token(node.left, node.right, old, new, "operator")
        if isinstance(node.op, ast.Add | ast.Sub):
            self._negate(node.left)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        start = self._start(node)
        if isinstance(node.op, ast.USub):
            self._add(start, start + 1, "", "sign")
        elif isinstance(node.op, ast.Not):
            self._add(start, start + 4, "", "condition")
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        left = node.left
        for op, right in zip(node.ops, node.comparators, strict=True):
            old, others = _COMPARISONS[type(op)]
            for new in others:
                self._token(left, right, old, new, "comparison")
            left = right
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for left, right in zip(node.values, node.values[1:], strict=False):
            self._token(left, right, old, new, "condition")
        self.generic_visit(node)

    def visit_If(self, node: ast.If) -> None:
        self._condition(node.test)
        self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._condition(node.test)
        self._negate_terms(node.body)
        self._negate_terms(node.orelse)
        self.generic_visit(node)

    def visit_Tuple(self, node: ast.Tuple) -> None:
        self._elements(node)

    def visit_List(self, node: ast.List) -> None:
        self._elements(node)

    def _elements(self, node: ast.Tuple | ast.List) -> None:
        if isinstance(node.ctx, ast.Load):
            for element in node.elts:
                self._negate_terms(element)
        self.generic_visit(node)

    def visit_Subscript(self, node: ast.Subscript) -> None:
        self.visit(node.value)
        inner = node.slice
        parts = (inner.lower, inner.upper) if isinstance(inner, ast.Slice) else (inner,)
        for part in parts:
            value = None if part is None else _integer(part)
            if part is not None and value is not None:
                for other in (value - 1, value + 1):
                    self._replace(part, str(other), "index")
            elif part is not None:
                self.visit(part)

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool) or not isinstance(value, int | float):
            return
        others = (value + 1,) if value in (0, 1) else (value + 1, value - 1)
        for other in others:
            self._replace(node, str(other), "constant")

    def visit_Call(self, node: ast.Call) -> None:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else None
        name = node.func.id if isinstance(node.func, ast.Name) else name
        if name in _ORDERED and len(node.args) > _ORDERED[name][1]:
            a, b = (node.args[i] for i in _ORDERED[name])
            between = self.text[self._end(a) : self._start(b)]
            swapped = self._text(b) + between + self._text(a)
            self._add(self._start(a), self._end(b), swapped, "arguments")
        if name in ("atan2", "cross"):
            for argument in node.args[:2]:
                self._negate_terms(argument)
        if name in _TWINS:
            end = self._end(node.func)
            self._add(end - len(name), end, _TWINS[name], "function")
        self.generic_visit(node)

    def _condition(self, test: ast.expr) -> None:
        if not isinstance(test, _BOUNDS):
            self._replace(test, f"not {self._text(test)}", "condition")

    def _negate_terms(self, node: ast.expr) -> None:
        """A minus before a value, where it has none and is no sum (whose signs are changed)."""
        summed = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)
        if not summed:
            self._negate(node)

    def _negate(self, node: ast.expr) -> None:
        scalar = isinstance(node, ast.Name | ast.Attribute | ast.Subscript | ast.BinOp | ast.Call)
        if isinstance(node, ast.Call):  # most functions give a vector, a frame or a body
            scalar = ast.unparse(node.func).rpartition(".")[2] in _SCALAR
        elif isinstance(node, ast.Name):  # a constant in capitals is no number but ZERO
            scalar = not node.id.isupper()
        summed = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)
        number = isinstance(node, ast.Constant) and type(node.value) in (int, float)
        if (scalar and not summed) or (number and node.value != 0):  # type: ignore[attr-defined]
            start = self._start(node)
            self._add(start, start, "-", "sign")

    def _token(self, left: ast.expr, right: ast.expr, old: str, new: str, kind: str) -> None:
        """Replace an operator between two operands (parentheses may stand there too)."""
        start, end = self._end(left), self._start(right)
        at = self.text.index(old, start, end)
        self._add(at, at + len(old), new, kind)

    def _replace(self, node: ast.expr, text: str, kind: str) -> None:
        self._add(self._start(node), self._end(node), text, kind)

    def _add(self, start: int, end: int, text: str, kind: str) -> None:
        self.edits[Edit(start, end, text, kind)] = None

    def _text(self, node: ast.expr) -> str:
        return self.text[self._start(node) : self._end(node)]

    def _start(self, node: ast.expr) -> int:
        return self._at(node.lineno, node.col_offset)

    def _end(self, node: ast.expr) -> int:
        return self._at(node.end_lineno or 0, node.end_col_offset or 0)

    def _at(self, line: int, column: int) -> int:
        """Position in the text; ast counts columns in bytes."""
        start = self.starts[line - 1]
        row = self.text[start : self.starts[line]]
        return start + len(row.encode()[:column].decode())


def _integer(node: ast.expr) -> int | None:
    """The value of a plain integer, with or without a minus."""
    try:
        value = ast.literal_eval(node)
    except ValueError:
        return None
    return value if type(value) is int else None


def _names_types(node: ast.expr) -> bool:
    """Whether an assigned value is an alias of types, such as `Sequence[Sequence[Scalar]]`."""
    return isinstance(node, ast.Subscript) and ast.unparse(node.value) in (
        "tuple", "list", "Sequence", "Literal",
    )  # fmt: skip
