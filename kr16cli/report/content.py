"""What a report is made of: results, drawing data, the robot's identity. Plain data, no pages."""

from __future__ import annotations

import datetime as dt
import hashlib
import os
import platform
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kr16cli import __version__
from kr16cli.assets import asset
from kr16cli.errors import InputError
from kr16cli.queries import info
from kr16cli.robot import RobotData
from kr16cli.verify.records import Result

if TYPE_CHECKING:
    from kr16cli.report.times import Bench
    from kr16cli.simulate.run import Run

Drawing = Mapping[str, Any]

KINDS = ("verification", "kinematics", "dynamics", "simulation")


class LackingError(Exception):
    """Raised by a page whose data are not there; the message says which."""


@dataclass(frozen=True)
class Outline:
    """One report of reports/outline.toml, and the words all reports share."""

    kind: str
    title: str
    suites: tuple[str, ...]
    pages: tuple[str, ...]
    words: Mapping[str, Any]


def outline(kind: str) -> Outline:
    """The outline of a report.

    Raises:
        InputError: an unknown report.
    """
    if kind not in KINDS:
        raise InputError(f"report {kind!r} is unknown; choose from {', '.join(KINDS)}")
    words = tomllib.loads(asset("reports/outline.toml").read_text(encoding="utf-8"))
    own = words["report"][kind]
    return Outline(kind, own["title"], tuple(own["suites"]), tuple(own["pages"]), words)


@dataclass(frozen=True)
class Evidence:
    """Results and where they come from.

    `source` says it in words; `files` are the files read, with their SHA-256; `fmus` are checks
    of FMUs; `bench` holds wall times, only where a bench file was given.
    """

    results: tuple[Result, ...]
    seed: int | None
    quick: bool | None
    source: str
    files: tuple[tuple[str, str], ...] = ()
    run: Run | None = None
    fmus: tuple[Result, ...] = ()
    bench: Bench | None = None


@dataclass
class Content:
    """Everything a page may draw."""

    outline: Outline
    data: RobotData
    evidence: Evidence
    drawings: Mapping[str, Drawing]
    absent: Mapping[str, str]
    created: dt.datetime
    left_out: dict[str, str] = field(default_factory=dict)

    @property
    def results(self) -> tuple[Result, ...]:
        """The cases of this report."""
        return (*self.evidence.results, *self.evidence.fmus)

    def of(self, *suites: str) -> list[Result]:
        """The cases of suites, in their order."""
        return [r for r in self.results if r.group in suites]

    def count(self, status: str) -> int:
        """How many cases passed, failed or were skipped."""
        return sum(r.status == status for r in self.results)

    def by_margin(self) -> list[Result]:
        """The cases that ran, largest share of the tolerance first; unmeasured failures lead."""
        ran = [r for r in self.results if r.status != "skipped"]
        return sorted(ran, key=lambda r: -(float("inf") if r.margin is None else r.margin))

    def result(self, id: str) -> Result:
        """A case that carries figures.

        Raises:
            LackingError: it is not there, or has none.
        """
        found = next((r for r in self.results if r.id == id), None)
        if found is None:
            raise LackingError(f"the results lack the case {id}")
        if not found.figures:
            reason = found.evidence if found.status != "passed" else "no figure data in the file"
            raise LackingError(f"case {id}: {reason}")
        return found

    def drawing(self, name: str) -> Drawing:
        """Drawing data by name.

        Raises:
            LackingError: the robot's file lacks what they need.
        """
        if name not in self.drawings:
            raise LackingError(self.absent.get(name, f"no drawing {name}"))
        return self.drawings[name]

    @property
    def equations(self) -> list[Mapping[str, Any]]:
        """The rows of the chapter's audit, in order.

        Raises:
            LackingError: the results carry none.
        """
        rows = [e for r in self.of("chapter") for e in r.figures.get("equations", ())]
        if not rows:
            raise LackingError("the results carry no rows of the chapter's audit")
        return rows

    @property
    def words(self) -> Mapping[str, Any]:
        """The texts of reports/outline.toml."""
        return self.outline.words

    @property
    def footer(self) -> str:
        """Version, robot and model hash."""
        return f"kr16cli {__version__} · {self.data.name} · model {self.data.sha256[:12]}"

    def identity(self) -> Mapping[str, Any]:
        """What `kr16 info` says of the robot."""
        return info.info(self.data)


def creation_time() -> dt.datetime:
    """SOURCE_DATE_EPOCH if it is set, else now; UTC, whole seconds.

    Raises:
        InputError: it is set to something else than seconds.
    """
    text = os.environ.get("SOURCE_DATE_EPOCH")
    if text is None:
        return dt.datetime.now(dt.UTC).replace(microsecond=0)
    try:
        return dt.datetime.fromtimestamp(int(text), dt.UTC)
    except (ValueError, OverflowError, OSError):
        raise InputError(
            f"SOURCE_DATE_EPOCH is {text!r}; it must be whole seconds since 1970, or unset"
        ) from None


def environment() -> list[tuple[str, str]]:
    """Packages and their versions, and the kind of machine."""
    found = [(k, v) for k, v in info.versions().items() if v is not None]
    engine = info.engine()
    return [
        *found,
        ("engine for arrays", engine["arrays"]),
        ("machine", f"{platform.system()} {platform.machine()}"),
    ]


def asset_hashes(data: RobotData) -> list[tuple[str, str]]:
    """SHA-256 of the files that results rest on."""
    own = Path(data.path)
    listed = [(own.name, own)] if own.is_file() else []
    folder = asset("data")
    for path in (folder / "chapter3.toml", *sorted((folder / "reference").glob("*.csv"))):
        listed.append((path.relative_to(folder.parent).as_posix(), path))
    return [(name, sha256(path.read_bytes())) for name, path in listed]


def sha256(content: bytes) -> str:
    """Hash as hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def commands(content: Content) -> list[str]:
    """What reproduces the report, one command a line."""
    seed = "" if content.evidence.seed is None else f" --seed {content.evidence.seed}"
    quick = " --quick" if content.evidence.quick else ""
    robot = f" --robot {Path(content.data.path).name}"
    if content.data.name == "KUKA KR 16-2":
        robot = ""
    suites = " ".join(f"--suite {name}" for name in content.outline.suites)
    given = "".join(f" --from {name}" for name, _ in content.evidence.files)
    return [
        f"kr16{robot} verify {suites}{quick}{seed}",
        f"SOURCE_DATE_EPOCH={int(content.created.timestamp())} kr16{robot} report "
        f"{content.outline.kind} -o {content.outline.kind}.pdf{quick}{seed}{given}",
    ]
