"""Which values a sweep takes: every combination, a Latin hypercube, or random draws."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from kr16cli.arrays import Array
from kr16cli.errors import InputError
from kr16cli.study.streams import uniforms

Kind = Literal["factorial", "latin", "monte-carlo"]

_STREAM = 2  # which of a seed's tables of random numbers
MOST_RUNS = 10**8
MOST_LEVELS = 10**6


class Variable(NamedTuple):
    """One --vary: its path and what it takes.

    `values` are the levels of a factorial; `low` and `high` the range, or with `normal` the mean
    and the standard deviation of a draw. With `factor` the numbers multiply the file's.
    """

    path: str
    values: tuple[float, ...] = ()
    low: float = 0.0
    high: float = 0.0
    normal: bool = False
    factor: bool = False


def variable(text: str) -> Variable:
    """A variable from `PATH=LOW:HIGH:COUNT`, `PATH=V,V,..`, `PATH=LOW:HIGH` or `PATH=MEAN+-SIGMA`.

    An x before the numbers (`x0.8:1.2:5`) makes them factors.

    Raises:
        InputError: text that is none of these, or an empty range.
    """
    path, equals, spec = text.partition("=")
    path, spec = path.strip(), spec.strip()
    if not equals or not path or not spec:
        raise InputError(
            f"--vary {text}: write PATH=LOW:HIGH:COUNT, PATH=V,V,.. or PATH=MEAN+-SIGMA"
        )
    factor = spec.startswith("x")
    if "+-" in spec:
        mean, sigma = (_number(part, text) for part in spec.split("+-", 1))
        if sigma <= 0.0:
            raise InputError(f"--vary {text}: sigma is {sigma:g}; it must be more than 0")
        return Variable(path, (), mean, sigma, True, factor)
    if ":" not in spec:
        levels = tuple(_number(part, text) for part in spec.split(","))
        return Variable(path, levels, min(levels), max(levels), False, factor)
    parts = spec.split(":")
    if len(parts) not in (2, 3):
        raise InputError(f"--vary {text}: a range is LOW:HIGH or LOW:HIGH:COUNT")
    low, high = _number(parts[0], text), _number(parts[1], text)
    if not low < high:
        raise InputError(f"--vary {text}: the range is empty; the lower end comes first")
    if len(parts) == 2:
        return Variable(path, (), low, high, False, factor)
    if not parts[2].strip().isdigit() or int(parts[2]) < 2:
        raise InputError(
            f"--vary {text}: COUNT is {parts[2]}; it must be a whole number of 2 or more"
        )
    count = int(parts[2])
    if count > MOST_LEVELS:
        raise InputError(f"--vary {text}: COUNT is {count}; at most {MOST_LEVELS} are possible")
    return Variable(path, tuple(np.linspace(low, high, count).tolist()), low, high, False, factor)


def _number(text: str, whole: str) -> float:
    try:
        value = float(text.strip().removeprefix("x") if "_" not in text else "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"--vary {whole}: '{text.strip()}' is no finite number")
    return value


@dataclass(frozen=True)
class Design:
    """Values of several variables, a row for each run; a row depends on its number alone."""

    variables: tuple[Variable, ...]
    kind: Kind = "factorial"
    runs: int = 0
    seed: int = 1

    def __post_init__(self) -> None:
        if not self.variables:
            raise InputError("a sweep needs something to vary; give --vary PATH=LOW:HIGH:COUNT")
        paths = [v.path for v in self.variables]
        twice = [path for path in paths if paths.count(path) > 1]
        if twice:
            raise InputError(f"--vary {twice[0]} is given twice; give each path once")
        for v in self.variables:
            if self.kind == "factorial" and not v.values:
                raise InputError(
                    f"--vary {v.path} has no count; write LOW:HIGH:COUNT, or ask for "
                    "--monte-carlo N or --latin N"
                )
        if self.kind != "factorial" and self.runs < 1:
            raise InputError(f"--{self.kind} is {self.runs}; it must be 1 or more")
        if self.count > MOST_RUNS:
            raise InputError(
                f"the sweep has {self.count:.3g} runs; at most {MOST_RUNS:.0e} are possible"
            )

    @property
    def count(self) -> int:
        """How many runs."""
        if self.kind == "factorial":
            return math.prod(len(v.values) for v in self.variables)
        return self.runs

    def rows(self, start: int, stop: int) -> Array:
        """Values of runs `start` to `stop`, (stop - start, variables); the last varies fastest."""
        if self.kind == "factorial":
            sizes = [len(v.values) for v in self.variables]
            index = np.unravel_index(np.arange(start, stop), sizes)
            levels = [np.array(v.values)[i] for v, i in zip(self.variables, index, strict=True)]
            return np.stack(levels, axis=-1)
        width = len(self.variables)
        if self.kind == "latin":
            unit = _hypercube(self.runs, width, self.seed)[start:stop]
        else:
            unit = uniforms(self.seed, _STREAM, start, stop, width)
        return np.stack([_spread(v, unit[:, i]) for i, v in enumerate(self.variables)], axis=-1)


def _spread(v: Variable, unit: Array) -> Array:
    """Numbers in (0, 1) as values of a variable; levels are taken with equal chance."""
    if v.normal:
        from scipy.special import ndtri

        made: Array = v.low + v.high * ndtri(unit)
        return made
    if v.values:
        levels: Array = np.array(v.values)[(unit * len(v.values)).astype(int)]
        return levels
    return v.low + (v.high - v.low) * unit


@lru_cache(maxsize=4)
def _hypercube(runs: int, width: int, seed: int) -> Array:
    """SciPy's Latin hypercube, the same in every process."""
    from scipy.stats import qmc

    generator = np.random.Generator(np.random.Philox(np.random.SeedSequence(seed)))
    sample = qmc.LatinHypercube(width, rng=generator).random(runs)
    made: Array = np.clip(sample, 1e-16, 1.0 - 1e-16)
    return made


def design(
    texts: Sequence[str], *, latin: int | None, monte_carlo: int | None, seed: int
) -> Design:
    """The design that options ask for.

    Args:
        texts: of `variable`, one for each variable.
        latin: runs of a Latin hypercube, or None.
        monte_carlo: random runs, or None.
        seed: of both.
    """
    if latin is not None and monte_carlo is not None:
        raise InputError("--latin and --monte-carlo exclude each other; give one")
    variables = tuple(map(variable, texts))
    if latin is not None:
        return Design(variables, "latin", latin, seed)
    if monte_carlo is not None:
        return Design(variables, "monte-carlo", monte_carlo, seed)
    return Design(variables)
