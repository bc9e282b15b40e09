"""Build an FMU for co-simulation (FMI 2.0) with pythonfmu; equal input gives equal bytes."""

from __future__ import annotations

import importlib
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from kr16cli.assets import asset
from kr16cli.errors import CheckFailedError, MissingPartError
from kr16cli.fmi import packing, pages, quick, shim, stage, written
from kr16cli.fmi.cargo import Cargo
from kr16cli.fmi.description import guid
from kr16cli.fmi.variables import Part, Start, table
from kr16cli.robot import RobotData

MODEL = "KR16"
_UNUSED = tuple(f"/pythonfmu/{name}.py" for name in ("__main__", "csvbuilder", "deploy"))


class Options(NamedTuple):
    """What an FMU is made of.

    `stop` and `step` (s) are the default experiment's. `compiler` is a C compiler for two parts
    that serve on Linux: the shim, which lets programs other than Python load the FMU, and the
    compiled functions, which make its steps several times quicker. None leaves them out.
    """

    start: Start
    part: Part = Part.ROBOT
    stop: float = 2.0
    step: float = 0.01
    scenario: str = ""
    compiler: str | None = None


def build(data: RobotData, options: Options) -> bytes:
    """The content of an FMU of a robot.

    Args:
        data: the robot, with inertial data.
        options: start values, default experiment, compiled parts.

    Returns:
        The bytes of the .fmu file. With SOURCE_DATE_EPOCH set, equal input gives equal bytes.

    Raises:
        InputError: no inertial data, or a SOURCE_DATE_EPOCH that is no time.
        MissingPartError: pythonfmu is not installed.
        CheckFailedError: the compiler failed.
    """
    packing.require_inertia(data)
    packing.source_time()  # refused before anything is made
    home = _home()
    version = metadata.version("pythonfmu")
    about = packing.about(
        data, options.part, options.scenario,
        stop=options.stop, step=options.step, tool=f" with PythonFMU {version}",
    )  # fmt: skip
    cargo = Cargo(about, table(data, options.start, options.part), data)
    slave, shipped = _shipped()
    files = stage.contents(cargo, written.python(), slave)
    library = shim.compiled(options.compiler) if options.compiler else b""
    module = quick.compiled(options.compiler) if options.compiler else b""
    digest = stage.identity(files, version.encode(), library, module)
    with tempfile.TemporaryDirectory(prefix="kr16_fmu_") as folder:
        here = Path(folder)
        script = stage.stage(
            here / "resources", files, digest, {quick.MODULE: module} if module else {}
        )
        documentation = _documentation(here / "documentation", shipped, cargo, digest)
        made = here / f"{MODEL}.fmu"
        with _as_before(script), _builder(home) as builder:
            builder.build_FMU(
                script, dest=made, project_files=[stage.package_of(script)],
                documentation_folder=documentation,
            )  # fmt: skip
            if module and f"{stage.package_of(script).name}.quick" not in sys.modules:
                raise CheckFailedError(
                    "this Python cannot load the functions that were compiled for it; "
                    "give --no-shim for an FMU without compiled parts"
                )
        return _packed(made, library, guid(digest))


def _home() -> Path:
    """Where pythonfmu is installed."""
    try:
        found = metadata.distribution("pythonfmu").locate_file("pythonfmu")
    except metadata.PackageNotFoundError:
        raise MissingPartError("pythonfmu", "fmu") from None
    return Path(str(found)).resolve()


@contextmanager
def _builder(home: Path) -> Iterator[Any]:
    """pythonfmu's builder as it is installed.

    An FMU that this process hosts may have brought its own copy of pythonfmu, without the libraries
    and from a folder that can go at any time.
    """
    known = sys.modules.get("pythonfmu")
    foreign = known is not None and Path(str(known.__file__)).resolve().parent != home
    path, brought = list(sys.path), _taken("pythonfmu") if foreign else {}
    sys.path[:] = [p for p in path if Path(p).resolve() == home.parent or not _has_copy(p)]
    try:
        try:
            module = importlib.import_module("pythonfmu.builder")
        except ImportError:
            raise MissingPartError("pythonfmu", "fmu") from None
        yield module.FmuBuilder
    finally:
        sys.path[:] = path
        if foreign:
            _taken("pythonfmu")
            sys.modules.update(brought)


def _has_copy(folder: str) -> bool:
    return (Path(folder) / "pythonfmu").is_dir()


@contextmanager
def _as_before(script: Path) -> Iterator[None]:
    """Leaves Python's path and modules as they were; the builder imports the script.

    The same build may be in the process already, hosted from a folder that is gone.
    """
    roots = (stage.package_of(script).name, script.stem)
    path, hosted = list(sys.path), _taken(*roots)
    sys.path.insert(0, str(script.parent))
    try:
        yield
    finally:
        sys.path[:] = path
        _taken(*roots)
        sys.modules.update(hosted)


def _taken(*roots: str) -> dict[str, ModuleType]:
    """Modules and what is in them, taken out of Python's table."""
    names = [name for name in sys.modules if name.split(".")[0] in roots]
    return {name: sys.modules.pop(name) for name in names}


@lru_cache(maxsize=1)
def _shipped() -> tuple[str, Mapping[str, bytes]]:
    """Text of the slave, files of the documentation; read once, as `stage.closure` is."""
    root = asset("fmu/documentation")
    files = sorted(path for path in root.rglob("*") if path.is_file())
    found = {path.relative_to(root).as_posix(): path.read_bytes() for path in files}
    return asset("fmu/kr16_slave.py").read_text(encoding="utf-8"), found


def _documentation(folder: Path, shipped: Mapping[str, bytes], cargo: Cargo, digest: str) -> Path:
    """The FMU's documentation folder: a page with the variables, and licences."""
    for name, content in shipped.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    page = folder / "index.html"
    texts = {"identity": digest, **{key: str(value) for key, value in cargo.about.items()}}
    text = page.read_text(encoding="utf-8")
    page.write_bytes(pages.filled(text, texts, map(pages.row, cargo.variables)))
    for file in metadata.files("pythonfmu") or ():
        if file.name.upper().startswith("LICENSE"):
            content = Path(str(file.locate())).read_bytes()
            (folder / "licenses" / "pythonfmu.txt").write_bytes(content)
    return folder


def _packed(made: Path, library: bytes, identity: str) -> bytes:
    """The archive with its entries in order, compressed, all of one time, the shim put in."""
    with zipfile.ZipFile(made) as archive:
        names = [n for n in archive.namelist() if not n.endswith(("/", *_UNUSED))]
        entries = {name: archive.read(name) for name in names}
    if library:
        entries = shim.put_in(entries, library, MODEL, identity)
    return packing.packed(entries, _when())


def _when() -> packing.ZipTime:
    """The time of every entry: SOURCE_DATE_EPOCH as a zip has it, else the first there is."""
    found = packing.source_time()
    if found is None:
        return packing.OLDEST
    year, month, day, hour, minute, second = found[:6]
    return max((year, month, day, hour, minute, second - second % 2), packing.OLDEST)
