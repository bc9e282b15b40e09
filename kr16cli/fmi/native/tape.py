"""Write a traced graph as a tape: its operations as numbers, which C runs on dual numbers.

A tape takes a quarter of the room of straight-line code and gives exact derivatives in any
direction; it is slower, so values are computed by code and derivatives by tape.
"""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.kernels.parameters import COUNT
from kr16cli.kernels.trace import Node, needed

_PAIRED = ("add", "sub", "mul", "div", "atan2", "lt", "le", "where")
OPERATIONS = (*_PAIRED, "neg", "sqrt", "sin", "cos", "else")
"""By their numbers on the tape. `where` is followed by `else` with its third argument."""

_NEAR = 255


def lines(name: str, inputs: int, results: Sequence[Node]) -> tuple[list[str], int]:
    """C lines of a tape, and how many places it needs.

    Places are the parameters, the inputs, the constants, then one for each line of the tape.
    """
    nodes = needed(results)
    constants = [n for n in nodes if n.op == "constant"]
    place = {n.number: COUNT + inputs + k for k, n in enumerate(constants)}
    first = COUNT + inputs + len(constants)
    code: list[tuple[int, int, int]] = []
    for node in nodes:
        if node.op in ("parameter", "input"):
            place[node.number] = int(node.value) + (COUNT if node.op == "input" else 0)
        elif node.op != "constant":
            a, b, *rest = (*(place[arg.number] for arg in node.args), 0)
            code.append((OPERATIONS.index(node.op), a, b))
            if node.op == "where":
                code.append((OPERATIONS.index("else"), rest[0], 0))
            place[node.number] = first + len(code) - 1
    return _text(name, inputs, results, constants, place, code), first + len(code)


def _text(
    name: str,
    inputs: int,
    results: Sequence[Node],
    constants: Sequence[Node],
    place: dict[int, int],
    code: Sequence[tuple[int, int, int]],
) -> list[str]:
    first = COUNT + inputs + len(constants)
    rows = [str(byte) for k, step in enumerate(code, first) for byte in _bytes(k, *step)]
    ends = ", ".join(str(place[n.number]) for n in results)
    values = ", ".join(repr(n.value) for n in constants) or "0.0"
    return [
        f"static const uint8_t {name}_code[] = {{",
        *("    " + ", ".join(rows[k : k + 20]) + "," for k in range(0, len(rows), 20)),
        "};",
        f"static const uint16_t {name}_ends[] = {{{ends}}};",
        f"static const double {name}_constants[] = {{{values}}};",
        f"const kr16_tape kr16_{name}_tape = {{",
        f"    {name}_code, {name}_ends, {name}_constants, {len(code)}, {inputs}, {len(constants)}, "
        f"{len(results)}}};",
        "",
    ]


def _bytes(place: int, op: int, first: int, second: int) -> list[int]:
    """An operation at a place as `header` describes it."""
    taken = (first, second)[: 2 if OPERATIONS[op] in _PAIRED else 1]
    far = [place - argument > _NEAR for argument in taken]
    found = [op | sum(16 << k for k, distant in enumerate(far) if distant)]
    for argument, distant in zip(taken, far, strict=True):
        found += [argument & 255, argument >> 8] if distant else [place - argument]
    return found


def header(names: Sequence[str], most: int) -> list[str]:
    """Declarations in C."""
    kinds = ", ".join(f"TAPE_{name.upper()}" for name in OPERATIONS)
    kinds += f", TAPE_ALONE = {len(_PAIRED)}"
    return [
        "/* Tapes of the same functions, for derivatives; see tape.c. */",
        f"enum {{ {kinds} }}; /* before TAPE_ALONE with two arguments */",
        f"#define KR16_TAPE_PLACES {most}",
        "",
        "typedef struct {",
        "    /* For each operation a byte: its number, + 16 and + 32 where its first and second",
        "     * argument are far. Then for each argument how many places it is before the",
        "     * operation, in one byte, or if it is far its place, in two. */",
        "    const uint8_t *code;",
        "    const uint16_t *ends; /* places of the results */",
        "    const double *constants;",
        "    int length, inputs, constant_count, results;",
        "} kr16_tape;",
        "",
        "extern const kr16_tape " + ", ".join(f"kr16_{name}_tape" for name in names) + ";",
    ]
