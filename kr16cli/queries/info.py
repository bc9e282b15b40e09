"""kr16 info: which robot, which numbers, from where, and what computes."""

from __future__ import annotations

from typing import Any

from kr16cli import __version__, units
from kr16cli.robot import Provenance, RobotData

_PACKAGES = ("numpy", "scipy", "typer", "matplotlib", "fmpy", "pythonfmu", "pin", "mujoco")

STATEMENT = (
    "Masses, inertias and drives marked sibling, derived, estimated or recalled are engineering "
    "estimates: verified numerically, not validated on a robot. Not affiliated with KUKA. Not for "
    "safety functions."
)


def version_line() -> str:
    """Version, default robot and model hash in a line."""
    from kr16cli.robot_file import load_data

    data = load_data()
    return f"kr16cli {__version__}, {data.name}, model {data.sha256}"


def info(data: RobotData) -> dict[str, Any]:
    """The robot with the status and source of each group of its numbers."""
    g = data.geometry
    groups = [
        _group("geometry", "m", g._asdict(), data.geometry_provenance),
        *(
            _group(
                f"joint {joint.name}",
                "deg, deg/s, N m, 1, kg m2, N m, N m s",
                {
                    "lower_deg": units.deg(joint.lower),
                    "upper_deg": units.deg(joint.upper),
                    "speed_deg_s": None if joint.speed is None else units.deg(joint.speed),
                    "torque_nm": joint.torque,
                    "gear_ratio": joint.gear_ratio,
                    "rotor_inertia": joint.rotor_inertia,
                    "coulomb_nm": joint.coulomb,
                    "viscous_nms": joint.viscous,
                },
                joint.provenance,
            )
            for joint in data.joints
        ),
        *(
            _group(
                f"link {i}",
                "kg, m, kg m2",
                {
                    "mass": link.mass,
                    "com": list(link.com),
                    "inertia": list(link.inertia),
                    "frame": link.frame,
                    "tolerance": link.tolerance,
                },
                link.provenance,
            )
            for i, link in enumerate(data.links, 1)
        ),
    ]
    if data.ratings_provenance is not None:
        groups.append(_group("ratings", "by name", dict(data.ratings), data.ratings_provenance))
    return {
        "name": data.name,
        "file": data.path,
        "model_sha256": data.sha256,
        "groups": groups,
        "conflicts": list(data.conflicts),
        "gravity": list(data.gravity),
        "moving_mass": sum(link.mass for link in data.links) if data.links else None,
        "engine": engine(),
        "versions": versions(),
        "statement": STATEMENT,
    }


def _group(name: str, unit: str, values: dict[str, Any], source: Provenance) -> dict[str, Any]:
    shown = {key: value for key, value in values.items() if value is not None}
    return {
        "group": name,
        "units": unit,
        "values": shown,
        "status": source.status,
        "source": list(source.source),
        "notes": dict(source.notes),
        "overrides": {
            key: {"status": other.status, "source": list(other.source)}
            for key, other in source.overrides.items()
        },
    }


def engine() -> dict[str, str]:
    """What computes batches of arrays, and what computes single queries."""
    from kr16cli.kernels.engine import engine_name

    return {"arrays": engine_name(), "single queries": "python floats"}


def versions() -> dict[str, str | None]:
    """Versions of kr16cli, Python and the packages it can use; None where not installed."""
    import platform
    from importlib.metadata import PackageNotFoundError, version

    found: dict[str, str | None] = {"kr16cli": __version__, "python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = None
    return found


def envelope(data: RobotData, result: dict[str, Any]) -> dict[str, Any]:
    """The result in the envelope all commands share."""
    return {
        "schema": "kr16.info/1",
        "robot": data.name,
        "model_sha256": data.sha256,
        "units": {"gravity": "m/s2", "moving_mass": "kg", "groups": "each names its own"},
        "input": {"robot": data.path},
        "result": result,
        "warnings": [],
    }
