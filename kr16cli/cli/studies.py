"""What `kr16 map`, `sweep` and `uncertainty` share: workers, progress, interruption, files."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kr16cli.cli import output as out
from kr16cli.cli import render, values
from kr16cli.cli.progress import Bar
from kr16cli.errors import InputError

if TYPE_CHECKING:
    from kr16cli.study.engine import Progress, Runner
    from kr16cli.study.store import Store
    from kr16cli.study.work import Work

Workers = Annotated[
    str | None,
    typer.Option("--workers", metavar="N", help="Threads or processes; default: every core."),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="A Dask scheduler, tcp://host:port; or local: Dask workers on this machine.",
    ),
]
Fresh = Annotated[
    bool, typer.Option("--fresh", help="Start anew: forget what an interrupted run kept.")
]
Plot = Annotated[
    str | None,
    typer.Option("--plot", metavar="FILE.pdf", help="Draw it, .pdf or .png; needs matplotlib."),
]


@contextmanager
def carried_out(p: Mapping[str, Any], work: Work, file: str | None) -> Iterator[Store]:
    """The finished study of a command's parameters; progress and what is kept go to stderr.

    Args:
        p: with `workers`, `scheduler` and `fresh`.
        work: the study.
        file: what will be written, or None.
    """
    from kr16cli.study.session import finished, partial_folder
    from kr16cli.study.work import chunks

    path = None if file is None else Path(file)
    progress = _Shown(chunks(work), None if path is None else partial_folder(path).name)
    try:
        with (
            runner(p) as by,
            finished(work, path, runner=by, fresh=p["fresh"], listen=progress) as store,
        ):
            progress.clear()
            yield store
    except (KeyboardInterrupt, SystemExit):
        progress.interrupted()
        raise
    finally:
        progress.clear()


@contextmanager
def runner(p: Mapping[str, Any]) -> Iterator[Runner]:
    """Who computes: a Dask cluster where --scheduler names one, else workers here."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    count = values.whole(p["workers"], "--workers", 1, 4096) or cores or 1
    if p["scheduler"] is None:
        from kr16cli.study.engine import Local

        yield Local(count)
        return
    from kr16cli.study.cluster import Cluster

    with Cluster(p["scheduler"], count) as cluster:
        yield cluster


class _Shown:
    """A bar on the terminal with the time left; on a pipe nothing but what matters later."""

    def __init__(self, total: int, folder: str | None) -> None:
        self._folder, self._total, self._done = folder, total, 0
        self._bar = Bar()
        self._begun = False

    def __call__(self, progress: Progress) -> None:
        self._done = progress.done
        if not self._begun and progress.done:
            self._say(f"going on: {progress.done} of {progress.total} chunks are there")
        self._begun = True
        left = "" if progress.left is None else f", {_duration(progress.left)} left"
        self._bar.show(progress.done, progress.total, left)

    def clear(self) -> None:
        """Take the bar away."""
        if self._begun:
            self._bar.clear()

    def interrupted(self) -> None:
        """Say what an interrupted run leaves."""
        self.clear()
        if self._folder is not None and self._done > 0:
            self._say(
                f"{self._done} of {self._total} chunks are kept in {self._folder}; the same "
                "command goes on from there"
            )

    @staticmethod
    def _say(text: str) -> None:
        if sys.stderr is not None:
            print(f"kr16: {text}", file=sys.stderr)


def _duration(seconds: float) -> str:
    """45 s, 12 min, 3.5 h."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def data_file(p: Mapping[str, Any], suffixes: tuple[str, ...]) -> str | None:
    """-o where it names a file of data by its suffix; None where it is for the summary, or absent.

    Raises:
        InputError: another suffix that is no summary's either.
    """
    name = p["output"]
    if name in (None, "-"):
        return None
    suffix = Path(name).suffix.lower()
    if suffix in suffixes:
        if p["format_"] not in (None, "table", "json"):
            raise InputError(f"--format {p['format_']}: the suffix of -o {name} sets the format")
        return str(name)
    if suffix not in (".json", ".txt"):
        known = ", ".join((*suffixes, ".json", ".txt"))
        raise InputError(f"-o {name}: the suffix must be one of {known}")
    return None


def tell(
    p: Mapping[str, Any],
    data: str | None,
    answer: Mapping[str, Any],
    table: Callable[[Mapping[str, Any]], str],
) -> None:
    """Write the summary: to stdout, or to -o where that is no file of data."""
    place = None if data is not None else p["output"]
    kind = out.choose_format(p["format_"], p["json"], place, ("table", "json"))
    text = render.json_text(answer) if kind == "json" else table(answer)
    with out.Target(place) as target:
        target.write(text)


@contextmanager
def picture(p: Mapping[str, Any], other: str | None) -> Iterator[Callable[[bytes], None] | None]:
    """Opens the file of --plot and yields what writes it; None without --plot."""
    file = p["plot"]
    if file is None:
        yield None
        return
    if Path(file).suffix.lower() not in (".pdf", ".png"):
        raise InputError(f"--plot {file}: the suffix must be .pdf or .png")
    if other is not None and Path(file).resolve() == Path(other).resolve():
        raise InputError(f"--plot {file}: is the file of -o, too; give another name")
    from kr16cli.report.motion_figures import require_matplotlib

    require_matplotlib()
    with out.Target(file) as target:
        yield target.write
