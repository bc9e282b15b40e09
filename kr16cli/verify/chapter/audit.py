"""Judges the whole chapter, in its order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kr16cli.verify.chapter import (
    printed_forward,
)
from kr16cli.verify.chapter.bench import Bench
from kr16cli.verify.chapter.judge import judge
from kr16cli.verify.chapter.records import Equation, Statement
from kr16cli.verify.records import Setting

SECTIONS: dict[str, Sequence[Statement]] = {
    "forward": printed_forward.STATEMENTS,
}
