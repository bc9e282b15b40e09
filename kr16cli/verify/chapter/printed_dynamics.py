"""Section 3.5 of the chapter as printed: mass matrix, Coriolis matrix, gravity."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from kr16cli.verify.chapter import model_side, motion
from kr16cli.verify.chapter.arm import Matrix, Point, apply, dot, flat, once, rate, rates, total
from kr16cli.verify.chapter.records import Statement, Values, definition, element
from kr16cli.verify.chapter.scalars import Scalar

INERTIA = (
    ("I_xx", "I_xy", "I_xz"),
    ("I_xy", "I_yz", "I_yz"),
    ("I_xz", "I_yz", "I_zz"),
)
"""I_k of (3.39) for k = 1, 2, 3."""

SHORT = {
    "M(5,6)": "0",
    "M(4,6)": "I6zz*cos(q5)",
    "M(3,6)": "I6zz*sin(q4)*sin(q5)",
    "M(2,6)": "I6zz*sin(q4)*sin(q5)",
    "M(4,5)": "-cos(q6)*sin(q5)*sin(q6)*(I6xx - I6yy)",
    "C(5,5)": "dq6*sin(2*q6)*(I6xx - I6yy)/2",
    "C(6,6)": "0",
}
"""The display after (3.43)."""

CHRISTOFFEL = "C_k(i,j) = {dM(k,j)/dq_i + dM(k,i)/dq_j - dM(%s)/dq_k}/2"


@model_side.remembered
def _bodies(p: Point) -> model_side.Links:
    return model_side.bodies(p, motion.in_links(p))


@once
def _true_mass(p: Point) -> Matrix:
    """M by (3.38) with Jacobians by differentiation."""
    return motion.mass_matrix_of(
        p, [(motion.linear(p, k), motion.angular(p, k)) for k in range(1, 7)]
    )


@once
def _true_coriolis(p: Point) -> Matrix:
    return motion.coriolis(p, motion.christoffel(p))


@model_side.remembered
def _model_mass(p: Point) -> Sequence[Scalar]:
    return model_side.mass_matrix(p, _bodies(p))


@model_side.remembered
def _model_coriolis(p: Point) -> Sequence[Scalar]:
    return model_side.coriolis_matrix(p, _bodies(p))


def _twice_kinetic(p: Point) -> Sequence[Scalar]:
    """2 K by velocities: sum m v.v + w.(R I R^T w), each by differentiation."""
    terms = []
    for k in range(1, 7):
        v = rates(motion.carried(p.along, k))
        w = apply(motion.angular(p, k), p.rates)
        in_link = [dot(axis, w) for axis in zip(*p.R(k), strict=True)]
        terms += [p.values[f"m{k}"] * dot(v, v), dot(in_link, apply(p.inertia(k), in_link))]
    return [total(terms)]


def _quadratic(p: Point) -> Sequence[Scalar]:
    return [dot(p.rates, apply(motion.mass_matrix(p), p.rates))]


def _model_mass_and_energy(p: Point) -> Sequence[Scalar]:
    """M and qd^T M qd, of the full and of the regrouped links."""
    found = []
    for n in (0, 36):
        m = _model_mass(p)[n : n + 36]
        rows = [[*m[6 * i : 6 * i + 6]] for i in range(6)]
        found += [*m, dot(p.rates, apply(rows, p.rates))]
    return found


def _cloud(p: Point) -> list[tuple[Scalar, list[Scalar]]]:
    """Four point masses (m, [x, y, z]) at places made of the point's lengths."""
    v = p.values
    names = (("a1", "a2", "r1"), ("r2", "a3", "d1"), ("d4", "r3", "r4"), ("r5", "d6", "r6"))
    return [(v[f"m{i}"], [v[n] for n in xyz]) for i, xyz in enumerate(names, 1)]


def _moment(name: str, p: Point) -> Scalar:
    """I_xx = sum m (y^2 + z^2), I_xy = -sum m x y, and so on."""
    i, j = ("xyz".index(c) for c in name[2:])
    terms = []
    for m, r in _cloud(p):
        terms.append(m * (dot(r, r) - r[i] * r[i]) if i == j else -(m * r[i] * r[j]))
    return total(terms)


def _inertia_element(i: int, j: int) -> Statement:
    """One element against sum m (r.r 1 - r r^T)."""
    right = "I_" + "xyz"[min(i, j)] + "xyz"[max(i, j)]

    def truth(p: Point) -> Sequence[Scalar]:
        terms = [m * (dot(r, r) * int(i == j) - r[i] * r[j]) for m, r in _cloud(p)]
        return [total(terms)]

    def named(name: str) -> Values:
        return lambda p: [_moment(name, p)]

    name = INERTIA[i][j]
    wrong = name != right
    return Statement(
        "3.39",
        (i + 1, j + 1),
        f"I_k[{i + 1},{j + 1}] = {name}, k in {{1, 2, 3}}",
        "misprint" if wrong else "holds",
        printed=named(name),
        truth=truth,
        corrected=named(right) if wrong else None,
        correction=f"I_k[{i + 1},{j + 1}] = {right}" if wrong else None,
        note="Executed on a cloud of point masses",
        unit="kg m^2",
    )


def _characterised(symbols: Callable[[Point], Sequence[Matrix]]) -> Values:
    """What fixes Christoffel symbols: symmetry in i, j, and C_k(i,j) + C_j(i,k) = dM(k,j)/dq_i."""

    def run(p: Point) -> Sequence[Scalar]:
        c = symbols(p)
        n = range(6)
        skew = [c[k][i][j] - c[k][j][i] for k in n for i in n for j in range(i)]
        return [*skew, *(c[k][i][j] + c[j][i][k] for i in n for k in n for j in range(k + 1))]

    return run


def _required(p: Point) -> Sequence[Scalar]:
    d = motion.mass_derivatives(p)
    n = range(6)
    return [*[0] * 90, *(d[i][k][j] for i in n for k in n for j in range(k + 1))]


def _model_symbols(p: Point) -> Sequence[Matrix]:
    v = model_side.christoffel(p, _bodies(p))
    return [[[*v[36 * k + 6 * i : 36 * k + 6 * i + 6]] for i in range(6)] for k in range(6)]


def _lagrange(p: Point) -> Sequence[Scalar]:
    """M' qd - d(qd^T M qd)/dq / 2, and M'."""
    d, qd = motion.mass_derivatives(p), p.rates
    m_dot = [[total([d[k][i][j] * qd[k] for k in range(6)]) for j in range(6)] for i in range(6)]
    force = [x - dot(qd, apply(d[k], qd)) / 2 for k, x in enumerate(apply(m_dot, qd))]
    return [*force, *flat(m_dot)]


def _equations_of_motion(p: Point, c: Matrix) -> Sequence[Scalar]:
    """C qd and C + C^T."""
    both = [[x + c[j][i] for j, x in enumerate(row)] for i, row in enumerate(c)]
    return [*apply(c, p.rates), *flat(both)]


def _model_motion(p: Point) -> Sequence[Scalar]:
    """The same by the model's C, and with C qd from its Newton-Euler torque less M qdd."""
    v = _model_coriolis(p)
    by_matrix = _equations_of_motion(p, [[*v[6 * i : 6 * i + 6]] for i in range(6)])
    torque = model_side.torque(p, _bodies(p))
    force = [t - x for t, x in zip(torque, apply(motion.mass_matrix(p), p.rates), strict=True)]
    return [*by_matrix, *force, *by_matrix[6:]]


def _by_first_angle(p: Point) -> Sequence[Scalar]:
    """dM/dq1, and the model's M and C at another q1 less those here."""
    other = p.at(q1=p.angles["phi"])
    moved = [
        *(a - b for a, b in zip(_model_mass(other), _model_mass(p), strict=True)),
        *(a - b for a, b in zip(_model_coriolis(other), _model_coriolis(p), strict=True)),
    ]
    return [*flat(motion.mass_derivatives(p)[0]), *moved]


def _gravity(p: Point) -> Sequence[Scalar]:
    return [rate(motion.potential(moving)) for moving in p.partials]


def _heights_of(own: bool) -> Values:
    """The heights of the six mass centres, or six times the first."""
    return lambda p: motion.heights(p) if own else [motion.heights(p)[0]] * 6


def _potential_of(own: bool) -> Values:
    def run(p: Point) -> Sequence[Scalar]:
        weights = [p.values[f"m{k}"] * p.values["g"] for k in range(1, 7)]
        return [dot(weights, _heights_of(own)(p))]

    return run


def _short(name: str, text: str) -> Statement:
    i, j = int(name[2]) - 1, int(name[4]) - 1
    mass = name[0] == "M"
    return element(
        name,
        None,
        name,
        text,
        lambda p: [(motion.mass_matrix(p) if mass else _true_coriolis(p))[i][j]],
        model=lambda p: [
            v[6 * i + j + 36 * n]
            for v in [_model_mass(p) if mass else _model_coriolis(p)]
            for n in range(len(v) // 36)
        ],
        unit="kg m^2" if mass else "kg m^2/s",
        note="" if mass else "The printed (3.41) gives the same here, so it does not show there",
    )


STATEMENTS: list[Statement] = [
    Statement(
        "3.38",
        None,
        "M(q) = sum over i = 1..6 of {m_i J_vi^T J_vi + J_omegai^T R_i^b I_i R_i^bT J_omegai}",
        "holds",
        printed=lambda p: [*flat(motion.mass_matrix(p)), *_quadratic(p)],
        truth=lambda p: [*flat(_true_mass(p)), *_twice_kinetic(p)],
        model=_model_mass_and_energy,
        note="Printed: Jacobians by the corrected (3.32), (3.33); Table 3.1: by differentiation, "
        "and twice the kinetic energy of the six bodies",
        unit="kg m^2",
    ),
    definition(
        "body frames, text after 3.38",
        "the frames attached to the mass centres are R_1^b, ..., R_6^b in order",
        "Fixed to their links: shown with p_c1 to p_c6",
    ),
    *[_inertia_element(i, j) for i in range(3) for j in range(3)],
    definition(
        "3.39",
        "I_k = diag(I_xx, I_yy, I_zz), k in {4, 5, 6}",
        "An assumption; used wherever I_4 to I_6 are executed",
    ),
    Statement(
        "3.40",
        None,
        "C(q, q') = [q'^T C_1; ...; q'^T C_6]",
        "holds",
        printed=lambda p: _equations_of_motion(p, _true_coriolis(p)),
        truth=_lagrange,
        model=_model_motion,
        note="With the corrected (3.41): C q' is the Lagrangian force and C + C^T = M'",
        unit="N m",
    ),
    Statement(
        "3.41",
        None,
        CHRISTOFFEL % "k,i",
        "misprint",
        printed=_characterised(lambda p: motion.christoffel(p, printed=True)),
        truth=_required,
        corrected=_characterised(motion.christoffel),
        correction=CHRISTOFFEL % "i,j",
        model=_characterised(_model_symbols),
        note="Compared by what fixes Christoffel symbols: C_k(i,j) = C_k(j,i) and "
        "C_k(i,j) + C_j(i,k) = dM(k,j)/dq_i. C(5,5) and C(6,6) come out right as printed",
        unit="kg m^2",
    ),
    Statement(
        "text after 3.41",
        None,
        "both M and C are independent of q1",
        "holds",
        printed=_by_first_angle,
        truth=lambda p: [0],
        note="dM/dq1 = 0, and C is made of derivatives of M; the model's M and C at two q1",
        unit="kg m^2",
    ),
    Statement(
        "3.42",
        None,
        "G(q) = dP/dq",
        "definition",
        truth=_gravity,
        model=lambda p: model_side.gravity(p, _bodies(p)),
        unit="N m",
    ),
    Statement(
        "3.43",
        None,
        "P_i = m_i g p_c1z",
        "misprint",
        printed=_potential_of(False),
        truth=lambda p: [motion.potential(p)],
        corrected=_potential_of(True),
        correction="P_i = m_i g p_ciz, P = sum of P_i",
        model=lambda p: model_side.potential(p, _bodies(p)),
        note="p_c1z = r1 is constant: as printed there is no gravity torque at all. Compared: P",
        unit="J",
    ),
    Statement(
        "text after 3.43",
        None,
        "p_c1z is the height of the centers of gravity for each link",
        "misprint",
        printed=_heights_of(False),
        truth=lambda p: [motion.carried(p, k)[2] for k in range(1, 7)],
        corrected=_heights_of(True),
        correction="p_ciz is the height of the centre of gravity of link i",
        unit="m",
    ),
    *[_short(name, text) for name, text in SHORT.items()],
]
