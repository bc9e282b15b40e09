"""Ask one question of the model, once or for every row of a batch, and write the answers."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from kr16cli.cli import output, render, rows, values
from kr16cli.errors import InputError, Kr16Error

if TYPE_CHECKING:
    import typer

    from kr16cli.queries.common import Answer, Question
    from kr16cli.robot import RobotData

_SHOWN_PROBLEMS = 5


class Common(NamedTuple):
    """What every query command takes, as typed."""

    robot: str | None
    si: bool
    source: str | None
    track: bool
    strict: bool
    kind: str
    output: str | None


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
        words, common = [], common._replace(source=common.source or "-")
    krl = ctx.params.get("krl")
    rows.only_one(("numbers", words), ("--krl", krl), ("--input", common.source))
    if common.source == "-" and rows.stdin_is_terminal():
        print(ctx.get_help(), file=sys.stderr)
        return 2
    data = load(ctx)
    question = make(data)
    if common.source:
        with output.Target(common.output) as target:
            return _batch(question, data, common, common.source, target)
    if common.track:
        raise InputError("--track works on the rows of --input; a single query has no row before")
    value = question.read_krl(krl) if krl else _typed(question, words)
    with output.Target(common.output) as target:
        return _single(question, data, common, value, target, tabulate)


def _common(ctx: typer.Context) -> Common:
    p = ctx.params
    kind = output.choose_format(p.get("format_"), bool(p.get("json")), p.get("output"))
    return Common(
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


def _envelope(
    question: Question, data: RobotData, inputs: Any, result: Any, warnings: Sequence[str]
) -> dict[str, Any]:
    return {
        "schema": f"kr16.{question.name}/1",
        "robot": data.name,
        "model_sha256": data.sha256,
        "units": question.units,
        "input": inputs,
        "result": result,
        "warnings": list(warnings),
    }


def _single(
    question: Question,
    data: RobotData,
    common: Common,
    value: Any,
    target: output.Target,
    tabulate: Callable[[Mapping[str, Any], Mapping[str, str]], str],
) -> int:
    answer = question.answer({question.reads: value})
    if common.kind == "json":
        inputs = {question.reads: value, **question.options}
        target.write(
            render.json_text(_envelope(question, data, inputs, answer.result, answer.warnings))
        )
    elif common.kind == "table":
        target.write(tabulate(answer.result, question.units))
    else:
        _write_rows(question, data, common.kind, [answer], ["ok"], target)
    if common.kind != "json":
        _warn(answer.warnings)
    if answer.problem:
        _warn([answer.problem], "")
        return 3
    return 0


def _batch(
    question: Question, data: RobotData, common: Common, source: str, target: output.Target
) -> int:
    batch = rows.read(source, question.reads, question.optional)
    answers: list[Answer | None] = []
    statuses: list[str] = []
    problems: list[str] = []
    tick = _progress(len(batch.rows))
    for i, row in enumerate(batch.rows, 1):
        answer, problem = _answer(question, row, track=common.track)
        answers.append(answer)
        statuses.append("bad" if answer is None else answer.status)
        if problem:
            problems.append(f"row {i}: {problem}")
        tick(i)
    warnings = [*batch.warnings, *_gathered(answers)]
    if problems and common.strict:
        more = f" ({len(problems)} such rows)" if len(problems) > 1 else ""
        raise InputError(f"{batch.name}, {problems[0]}{more}; --strict: nothing is written")
    if common.kind == "json":
        shown = [
            {"status": status, "reason": problem, **(answer.result if answer else {})}
            for answer, status, problem in zip(
                answers, statuses, _by_row(problems, len(answers)), strict=True
            )
        ]
        inputs = {"source": batch.name, "rows": len(answers), **question.options}
        envelope = _envelope(question, data, inputs, {"rows": shown}, warnings)
        target.write(render.json_text(envelope))
    else:
        reasons = _by_row(problems, len(answers))
        _write_rows(question, data, common.kind, answers, statuses, target, reasons)
        _warn(warnings)
    _summarise(batch.name, problems, len(answers))
    return 1 if problems else 0


def _answer(question: Question, row: rows.Row, *, track: bool) -> tuple[Answer | None, str | None]:
    """The answer to one row, or None, and what is wrong with the row."""
    if row.problem is not None:
        return None, row.problem
    try:
        answer = question.answer(row.values)
    except Kr16Error as error:
        return None, str(error)
    if track:
        question.follow(answer)
    return answer, answer.problem


def _gathered(answers: Sequence[Answer | None]) -> list[str]:
    """Each warning of the rows once, with the rows it is about."""
    about: dict[str, list[int]] = {}
    for i, answer in enumerate(answers, 1):
        for text in answer.warnings if answer else ():
            about.setdefault(text, []).append(i)
    if len(about) > _SHOWN_PROBLEMS:
        first = next(iter(about))
        count = len({i for found in about.values() for i in found})
        return [f"{count} rows have warnings; the first: row {about[first][0]}: {first}"]
    return [
        f"row{'s' if len(found) > 1 else ''} {', '.join(map(str, found[:3]))}"
        f"{f' and {len(found) - 3} more' if len(found) > 3 else ''}: {text}"
        for text, found in about.items()
    ]


def _by_row(problems: Sequence[str], count: int) -> list[str | None]:
    reasons: list[str | None] = [None] * count
    for problem in problems:
        row, _, reason = problem.removeprefix("row ").partition(": ")
        reasons[int(row) - 1] = reason
    return reasons


def _write_rows(
    question: Question,
    data: RobotData,
    kind: str,
    answers: Sequence[Answer | None],
    statuses: Sequence[str],
    target: output.Target,
    reasons: Sequence[str | None] | None = None,
) -> None:
    """Rows as CSV, npz or a table; a row without an answer has a status and a reason only."""
    if kind == "npz":
        from kr16cli.cli.archive import npz_bytes

        target.write(npz_bytes(question, data, answers, statuses))
        return
    empty = dict.fromkeys(question.columns(None))
    table = [
        {
            **(question.columns(answer.result) if answer else empty),
            "units": question.csv_units,
            "status": status,
            **({"reason": reason} if reasons is not None else {}),
        }
        for answer, status, reason in zip(
            answers, statuses, reasons or [None] * len(answers), strict=True
        )
    ]
    if kind == "csv":
        target.write(render.csv_text(table))
    else:
        target.write(render.batch_table(table, question.column_units))


def _summarise(name: str, problems: Sequence[str], count: int) -> None:
    if problems:
        more = len(problems) - _SHOWN_PROBLEMS
        _warn(problems[:_SHOWN_PROBLEMS], "")
        text = f"{len(problems)} of {count} rows of {name} have no answer"
        _warn([text + (f" ({more} more than shown)" if more > 0 else "")], "")


def _warn(texts: Sequence[str], kind: str = "warning: ") -> None:
    for text in texts:
        print(f"kr16: {kind}{' '.join(text.split())}", file=sys.stderr)


def _progress(total: int) -> Callable[[int], None]:
    """Counts rows on stderr, on a terminal only."""
    if total < 2000 or sys.stderr is None or not sys.stderr.isatty():
        return lambda done: None

    def tick(done: int) -> None:
        if done % 500 == 0 or done == total:
            end = "\r\x1b[K" if done == total else ""
            print(f"\r{done} of {total} rows{end}", end="", file=sys.stderr, flush=True)

    return tick
