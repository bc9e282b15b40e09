"""Ask one question of the model, once or for every row of a batch, and write the answers."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from kr16cli.cli import batch, output, render, rows, values
from kr16cli.errors import InputError

if TYPE_CHECKING:
    import typer

    from kr16cli.queries.common import Question
    from kr16cli.robot import RobotData


def load(ctx: typer.Context) -> RobotData:
    """The robot of --robot after the command, else before it, else the KR 16-2."""
    from kr16cli.robot_file import load_data

    before = ctx.obj.get("robot") if isinstance(ctx.obj, dict) else None
    return load_data(ctx.params.get("robot") or before)


def ask(
    ctx: typer.Context,
    make: Callable[[RobotData], Question],
    tabulate: Callable[[Mapping[str, Any], Mapping[str, str]], str],
) -> int:
    """Answer a query command and return its exit code.

    Args:
        ctx: its context; the shared options are read from its parameters.
        make: builds the question from the robot's numbers.
        tabulate: a single result and its units as a table.
    """
    common = _common(ctx)
    words = list(ctx.params.get("values_") or ())
    if words == ["-"]:
        rows.only_one(("-", True), ("--input", common.source))
        words, common = [], common._replace(source="-")
    krl = ctx.params.get("krl")
    rows.only_one(("numbers", words), ("--krl", krl), ("--input", common.source))
    if common.source == "-" and rows.stdin_is_terminal():
        print(ctx.get_help(), file=sys.stderr)
        return 2
    data = load(ctx)
    question = make(data)
    if common.source is not None:
        with output.Target(common.output) as target:
            return batch.answer_rows(question, data, common, common.source, target)
    if common.track:
        raise InputError("--track works on the rows of --input; a single query has no row before")
    value = question.read_krl(krl) if krl is not None else _typed(question, words)
    with output.Target(common.output) as target:
        return _single(question, data, common, value, target, tabulate)


def _common(ctx: typer.Context) -> batch.Common:
    p = ctx.params
    kind = output.choose_format(p.get("format_"), bool(p.get("json")), p.get("output"))
    return batch.Common(
        p.get("robot"), bool(p.get("si")), p.get("source"), bool(p.get("track")),
        bool(p.get("strict")), kind, p.get("output"),
    )  # fmt: skip


def _typed(question: Question, words: Sequence[str]) -> list[float]:
    if len(words) == 1 and "{" in words[0]:
        return question.read_krl(words[0])
    names = values.JOINT_NAMES if question.reads == "q" else values.POSE_NAMES
    if not words:
        raise InputError(
            f"{question.name} needs six numbers ({' '.join(names)}), --krl TEXT, --input FILE or "
            f"- for stdin; kr16 {question.name} --help shows examples"
        )
    return values.numbers(words, names, question.name)


def _single(
    question: Question,
    data: RobotData,
    common: batch.Common,
    value: Any,
    target: output.Target,
    tabulate: Callable[[Mapping[str, Any], Mapping[str, str]], str],
) -> int:
    answer = question.finite_answer({question.reads: value})
    if common.kind == "json":
        inputs = {question.reads: value, **question.options}
        target.write(render.json_text(question.envelope(inputs, answer.result, answer.warnings)))
    elif common.kind == "table":
        target.write(tabulate(answer.result, question.units))
    else:
        target.write(batch.one_row(question, data, common.kind, answer))
    if common.kind != "json":
        batch.warn(answer.warnings)
    if common.kind == "csv":
        batch.warn(batch.unlisted(question, "csv"))
    if answer.problem:
        batch.warn([answer.problem], "")
        return 3
    return 0
