"""The parts of the package that an FMU needs, as a package of its own with a private name.

The name holds the hash of all that is in it: two different FMUs in one process, or an FMU in a
host that has kr16cli imported, never share a module.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

import kr16cli
from kr16cli.errors import FileError
from kr16cli.fmi import cargo as freight

PACKAGE = "kr16cli"
ENTRIES = ("kr16cli.fmi.slave_side", "kr16cli.fmi.description")
WRITTEN = "functions.py"
_ENTRY = '''"""Names the slave; pythonfmu's wrapper runs this text anew for each instance."""

from {package}.fmi.slave_side import keep
from {package}.slave import KR16

__all__ = ["KR16"]

keep(globals())
'''
_ROOT = Path(kr16cli.__file__).resolve().parent


@lru_cache(maxsize=2)
def closure(entries: Sequence[str] = ENTRIES) -> Mapping[str, str]:
    """Sources of modules and of all of the package that they import.

    They are read once in a process, so that its builds agree whatever happens to the files.

    Returns:
        Source by path below the package: {"model/chain.py": ...}, sorted.
    """
    found: dict[str, str] = {}
    waiting = [*entries]
    while waiting:
        path = _path(waiting.pop())
        if path is None or (key := path.relative_to(_ROOT).as_posix()) in found:
            continue
        if path == _ROOT / "__init__.py":
            continue  # the facade; `contents` writes a smaller one
        try:
            found[key] = path.read_text(encoding="utf-8")
        except OSError as error:
            reason = error.strerror or str(error)
            raise FileError(path, f"cannot be read: {reason}; reinstall kr16cli") from None
        waiting += _imports(found[key], key)
        waiting += [f"{PACKAGE}.{parent.as_posix().replace('/', '.')}"
                    for parent in Path(key).parents if parent != Path()]  # fmt: skip
    return MappingProxyType(dict(sorted(found.items())))


def _path(module: str) -> Path | None:
    """The file of a module of the package, or None where the name is not a module's."""
    stem = _ROOT.joinpath(*module.split(".")[1:])
    for path in (stem / "__init__.py", stem.with_suffix(".py")):
        if path.is_file():
            return path
    return None


def _nodes(source: str) -> Iterator[ast.Import | ast.ImportFrom]:
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node


def _imports(source: str, key: str) -> Iterator[str]:
    """Dotted names of the package that a source may mean."""
    for node in _nodes(source):
        if isinstance(node, ast.Import):
            yield from (a.name for a in node.names if a.name.split(".")[0] == PACKAGE)
        elif node.level:
            raise FileError(key, "has a relative import; write kr16cli.NAME, which staging renames")
        elif node.module and node.module.split(".")[0] == PACKAGE:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def renamed(source: str, package: str) -> str:
    """The source with every import of kr16cli turned to `package`."""
    lines = source.splitlines(keepends=True)
    for node in _nodes(source):
        line = lines[node.lineno - 1]
        head, tail = line[: node.col_offset], line[node.col_offset :]
        lines[node.lineno - 1] = head + tail.replace(PACKAGE, package, 1)
    return "".join(lines)


def identity(files: Mapping[str, str], *more: bytes) -> str:
    """SHA-256 of files and what else makes a build."""
    digest = hashlib.sha256()
    for key, text in sorted(files.items()):
        for part in (key.encode(), text.encode()):
            digest.update(len(part).to_bytes(8, "big") + part)
    for part in more:
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.hexdigest()


def contents(cargo: freight.Cargo, written: str, slave: str) -> dict[str, str]:
    """The files of the private package before renaming, without its `__init__.py`.

    Args:
        cargo: the numbers that travel.
        written: text of the written-out dynamics.
        slave: source of the slave.
    """
    return {
        **closure(), WRITTEN: written, "slave.py": slave, freight.NAME: freight.dump(cargo),
    }  # fmt: skip


def stage(folder: Path, files: Mapping[str, str], digest: str, more: Mapping[str, bytes]) -> Path:
    """Write the private package and the script that names the slave into a folder.

    Args:
        folder: where they go.
        files: what `contents` gave.
        digest: the build's identity.
        more: files of the package that are no text.

    Returns:
        The script; the package lies beside it.
    """
    package = f"kr16_core_{digest[:16]}"
    init = (
        f'"""What this FMU needs of kr16cli {kr16cli.__version__}."""\n\n'
        f'__version__ = "{kr16cli.__version__}"\nIDENTITY = "{digest}"\n'
    )
    for key, text in {**files, "__init__.py": init}.items():
        path = folder / package / key
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes((renamed(text, package) if key.endswith(".py") else text).encode())
    for key, content in more.items():
        (folder / package / key).write_bytes(content)
    script = folder / f"kr16_slave_{digest[:16]}.py"
    script.write_bytes(_ENTRY.format(package=package).encode())
    return script


def package_of(script: Path) -> Path:
    """The private package beside a staged script."""
    return script.with_name(script.stem.replace("kr16_slave_", "kr16_core_"))
