"""The chapter's misprints, as changes of the model that put each back.

Misprints in words that no formula of the model follows are not here: the text after (3.13), the
left-hand side of (3.48), the texts after (3.43), (3.48) and (3.51).
"""

from __future__ import annotations

from typing import NamedTuple


class Misprint(NamedTuple):
    """What the chapter prints, and the model's text that it would replace."""

    equation: str
    file: str
    right: str
    printed: str


MISPRINTS = (
    Misprint(
        "(3.4)", "forward.py", "return Frame(x, y, a.flange_z, a.flange_p)",
        "return Frame(x, (y[0], y[1], -a.tangent[2]), a.flange_z, a.flange_p)",
    ),
    Misprint(
        "(3.13)", "inverse.py", "square = u * u + w * w", "square = (u * u + w * w) ** 2"
    ),
    Misprint(
        "text after (3.14)", "inverse.py", "q3_under, q3_over = -bend - tilt, bend - tilt",
        "q3_under, q3_over = bend - tilt, bend - tilt",
    ),
    Misprint(
        "(3.21)", "inverse.py", "c23, s23 = forearm\n", "c23, s23 = forearm[0], -forearm[1]\n"
    ),
    Misprint(
        "(3.24)", "inverse.py", "q5 = ns.atan2(ns.where(singular, 0, s5), c5)",
        "q5 = ns.atan2(ns.where(singular, 0, s5), -c5)",
    ),
    Misprint(
        "(3.28)", "inverse.py", "q6 = principal(", "q6 = ns.where(singular, q4, 0) + principal("
    ),
    Misprint(
        "text after (3.30)", "jacobian.py", "for half in (0, 1) for i in range(3)",
        "for half in (1, 0) for i in range(3)",
    ),
    Misprint(
        "(3.32)", "jacobian.py", "(cross(z, sub(point, o)), z) if",
        "(cross(a.axes[0], sub(point, o)), z) if",
    ),
    Misprint(
        "text after (3.32)", "jacobian.py",
        "        for i, (z, o) in enumerate(zip(a.axes, a.origins, strict=True))\n"
        "    ]\n    return _rows(columns)",
        "        for i, (z, o) in enumerate(zip(a.axes, a.origins, strict=True))\n"
        "    ]\n"
        "    return [row if i < link else [ZERO] * 6 for i, row in enumerate(_rows(columns))]",
    ),
    Misprint(
        "(3.33)", "jacobian.py", "sub(point, o)), z) if i < link",
        "sub(point, o)), z if i < 5 else a.flange_z) if i < link",
    ),
    Misprint(
        "text after (3.36)", "jacobian.py",
        "return g.a2 * wrist_factor(cs) * elbow_factor(cs, g) * shoulder_factor(cs, g)",
        "return g.a2 * wrist_factor(cs) * shoulder_factor(cs, g)",
    ),
    Misprint(
        "(3.39)", "inertia.py", "iyy + mass * (x * x + z * z)", "iyz + mass * (x * x + z * z)"
    ),
    Misprint(
        "(3.41)", "coriolis.py",
        "return [[slices[i][k] for i in range(6)] for k in range(6)]",
        "s = slices\n    return [[[(s[i][k][j] + s[i][j][k] + s[j][k][i] + s[j][i][k] - s[k][k][i] "
        "- s[k][i][k]) / 2 for j in range(6)] for i in range(6)] for k in range(6)]",
    ),
    Misprint(
        "(3.43)", "energy.py", "add(scale(body.m, frame.p), frame.rotate(body.h))",
        "scale(body.m, mass_centres(links, bodies, g)[0])",
    ),
)  # fmt: skip
"""In the order of the chapter."""
