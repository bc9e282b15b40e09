"""Single results as tables, one function per command."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kr16cli.cli.render import grid, matrix, shown, vector

Result = Mapping[str, Any]
Units = Mapping[str, str]
_JOINTS = ("A1", "A2", "A3", "A4", "A5", "A6")


def _text(lines: Sequence[str]) -> str:
    return "\n".join(lines) + "\n"


def fk(result: Result, units: Units) -> str:
    """The pose, Status and Turn, the KRL line; frames and mass centres where asked for."""
    pose = result["pose"]
    rows = [
        [cell for n in names for cell in (n.upper(), shown(pose[n], units[n]), units[n], "")]
        for names in ("xyz", "abc")
    ]
    lines = [f"{result['of']} in {result['in']}"]
    lines += grid([], [row[:-1] for row in rows])
    lines += [f"  S {pose['s']}  T {pose['t']}", f"  {result['krl']}"]
    for name, T in result.get("frames", {}).items():
        lines += ["", f"{name} in {result['frames_in']}, m", *matrix(T, "m")]
    if "R36" in result:
        where = f"wrist centre in {result['frames_in']}, {units['wrist_centre']}"
        lines += ["", where, f"  {vector(result['wrist_centre'], units['wrist_centre'])}"]
        lines += ["", "R36 (3.22)", *matrix(result["R36"], "m")]
    if "mass_centres" in result:
        lines += ["", f"mass centres of links 1 to 6, {units['mass_centres']}"]
        lines += matrix(result["mass_centres"], units["mass_centres"])
    return _text(lines)


def ik(result: Result, units: Units) -> str:
    """Solutions, nearest first, then what is missing and the singular case."""
    unit = units["q"]
    count = len(result["solutions"])
    order = ", nearest first" if count > 1 else ""
    lines = [f"{count} solution{'' if count == 1 else 's'}{order}; angles in {unit}"]
    rows = [
        [
            *(shown(angle, unit) for angle in one["q"]),
            str(one["status"]),
            str(one["turn"]),
            _bits(one["branch"]),
            "yes" if one["within_limits"] else ", ".join(v["joint"] for v in one["violations"]),
            f"{one['residual']:.0e}",
        ]
        for one in result["solutions"]
    ]
    if rows:
        lines += grid([*_JOINTS, "S", "T", "branch", "in limits", "residual"], rows)
        lines.append("  branch: shoulder elbow wrist; residual: the larger of m and rad")
    reasons: dict[str, list[str]] = {}
    for one in result["missing"]:
        reasons.setdefault(one["reason"], []).append(_bits(one["branch"]))
    lines += [f"missing {', '.join(bits)}: {reason}" for reason, bits in reasons.items()]
    if result["singularity"]:
        lines.append(
            f"{result['singularity']['kind']} singularity: {result['singularity']['rule']}"
        )
    if result["solutions"]:
        lines.append(f"nearest: {result['solutions'][0]['krl']}")
    return _text(lines)


def _bits(branch: Mapping[str, int]) -> str:
    return f"{branch['shoulder']}{branch['elbow']}{branch['wrist']}"


def jacobian(result: Result, units: Units) -> str:
    """The Jacobian, its measures, and the three singular families."""
    lines = [
        f"Jacobian of {result['point']}, link {result['link']}, axes of {result['axes']}",
        f"rows {' '.join(result['rows'])}: m/rad, then rad/rad",
        *matrix(result["jacobian"]),
    ]
    if "jacobian_dot" in result:
        lines += ["", "its rate, m/(rad s), rad/(rad s)", *matrix(result["jacobian_dot"])]
    measures = [
        ["determinant", shown(result["determinant"]), "m3"],
        ["manipulability", shown(result["manipulability"]), "m3, lengths in m"],
        ["condition", shown(result["condition"]), result.get("condition_reason", "lengths in m")],
    ]
    lines += ["", *grid([], measures)]
    lines += [f"  singular values  {vector(result['singular_values'])}"]
    families = [
        [one["kind"], shown(one["factor"]), "near" if one["near"] else "", one["meaning"]]
        for one in result["singularities"]
    ]
    lines += ["", "singular families (zero is singular)", *grid([], families)]
    lines += ["", f"roll, pitch, yaw, rad: {vector(result['rpy'], 'rad')}"]
    lines += ["rate matrix B (3.46)", *matrix(result["rate_matrix"])]
    if result["rate_matrix_inverse"] is None:
        lines += [f"no inverse: {result['rate_matrix_inverse_reason']}"]
    else:
        lines += ["its inverse", *matrix(result["rate_matrix_inverse"])]
    return _text(lines)


def dynamics(result: Result, units: Units) -> str:
    """Matrices and vectors with their units, energies, the load on the foundation."""
    lines: list[str] = []
    for name, title in (
        ("mass_matrix", "mass matrix M"),
        ("coriolis_matrix", "Coriolis matrix C"),
    ):
        lines += [f"{title}, {units[name]}", *matrix(result[name]), ""]
    names = ("gravity", "friction", "torque", "acceleration")
    present = [name for name in names if name in result]
    rows = [
        [joint, *(shown(result[name][i]) for name in present)] for i, joint in enumerate(_JOINTS)
    ]
    lines += grid(["", *(f"{name}, {units[name]}" for name in present)], rows)
    energy, wrench = result["energy"], result["base_wrench"]
    lines += [
        "",
        f"energy: kinetic {shown(energy['kinetic'])} J, potential {shown(energy['potential'])} J",
        f"foundation on arm ({result['base_wrench_of']}), about robroot's origin:",
        f"  force {vector(wrench[:3])} N",
        f"  moment {vector(wrench[3:])} N m",
    ]
    for k, ck in enumerate(result.get("christoffel", ()), 1):
        lines += ["", f"C_{k} (3.41), {units['christoffel']}", *matrix(ck)]
    if result.get("task"):
        for name, value in result["task"].items():
            title = f"task space {name.replace('_', ' ')}, {units['task']}"
            is_matrix = isinstance(value[0], list)
            lines += ["", title, *(matrix(value) if is_matrix else [f"  {vector(value)}"])]
    return _text(lines)


def info(result: Result, units: Units) -> str:
    """Name, groups of numbers with status and source, conflicts, engine and versions."""
    lines = [result["name"], f"  file {result['file']}", f"  model {result['model_sha256']}", ""]
    rows = [
        [one["group"], one["status"], " ".join(one["source"]), _overrides(one["overrides"])]
        for one in result["groups"]
    ]
    lines += grid(["group", "status", "sources", "other status of single numbers"], rows)
    for one in result["groups"]:
        values = ", ".join(f"{k} {_value(v)}" for k, v in one["values"].items())
        lines += ["", f"{one['group']} ({one['units']})", f"  {values}"]
        lines += [f"  {key}: {text}" for key, text in one["notes"].items()]
    lines += ["", "conflicts between sources"]
    lines += [f"  {text}" for text in result["conflicts"]] or ["  none"]
    gravity = " ".join(_value(v) for v in result["gravity"])
    lines += ["", f"gravity {gravity} m/s2 in robroot"]
    lines += [f"engine: {', '.join(f'{v} for {k}' for k, v in result['engine'].items())}"]
    lines += grid([], [[k, v or "not installed"] for k, v in result["versions"].items()])
    lines += ["", result["statement"]]
    return _text(lines)


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{' '.join(_value(v) for v in value)}]"
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def _overrides(overrides: Mapping[str, Mapping[str, Any]]) -> str:
    return ", ".join(f"{key}: {one['status']}" for key, one in overrides.items())
