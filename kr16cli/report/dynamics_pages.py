"""Pages on dynamics, simulation, other engines, a recorded run, and measured times."""

from __future__ import annotations

from matplotlib import rc_context

from kr16cli.report import figures, motion_figures, robot_figures
from kr16cli.report.content import Content, Drawing, LackingError
from kr16cli.report.page import FULL, HEIGHT, LEFT, RIGHT, Document
from kr16cli.report.suite_tables import claims, headline, sampled, worst_point
from kr16cli.report.table import Column, table
from kr16cli.study.bands import Bands


def dynamics(document: Document, content: Content) -> None:
    """Identities of the equations of motion."""
    results = content.of("dynamics")
    if not results:
        raise LackingError("the results hold no case of the suite dynamics")
    title = headline(results, "The equations of motion keep every identity they must", "dynamics")
    page = document.page(title)
    page.paragraph(
        "M is symmetric and positive definite, Ṁ - 2C is skew, the terms add up to Newton and "
        "Euler's torques, Lagrange's equations written apart agree, and energy balances power. "
        "This verifies the equations; the masses and inertias they are fed with are estimates."
    )
    page = claims(document, page, title, results)
    ran = [r for r in results if r.margin]
    if ran:
        page.caption(worst_point(max(ran, key=lambda r: r.margin or 0.0)))


def mass_centres(document: Document, content: Content) -> None:
    """Figure 3.3: mass centres of the chapter's arm and of the robot."""
    drawing = content.drawing("mass_centres")
    page = document.page("Mass centres of the chapter's arm, and of the robot (figure 3.3)")
    gap = 48.0
    wide = (FULL - 34 - gap) / 2
    for row, (up, label) in enumerate(((2, "z, m"), (1, "y, m"))):
        height = 126.0 if row == 0 else 94.0
        for k, arm in enumerate(drawing["arms"]):
            left = LEFT + 34 + k * (wide + gap)
            axis = page.axes(height, left, left + wide, above=18, below=0, move=False)
            robot_figures.mass_view(axis, arm, up, ("x, m", label))
            axis.set_xlim(-0.3, 1.95)
            axis.set_ylim((-0.1, 1.25) if up == 2 else (-0.5, 0.5))
            axis.set_title(f"{arm['name']}, {'side' if up == 2 else 'from above'}", fontsize=8.5)
        page.y += height + 44
    page.caption(
        "Figure 3.3 of the chapter at the zero pose. Disc: mass centre p_c1 to p_c6 by number, "
        "area by mass; cross: all together. The chapter puts the centres on lines (3.29); those of "
        "the robot are general, so the model takes general ones, the chapter's among them."
    )
    heads = ("chapter's arm: mass, kg", "centre x y z, mm", "robot: mass, kg", "centre x y z, mm")
    columns = (Column("link", 30), *(Column(head, 92, "right") for head in heads))
    rows = []
    for i in range(6):
        cells = [str(i + 1)]
        for arm in drawing["arms"]:
            place = " ".join(f"{1e3 * v + 0.0:.0f}" for v in arm["centres"][i])
            cells += [f"{arm['mass'][i]:.4g}", place.replace("-0 ", "0 ")]
        rows.append(cells)
    table(document, page, "Mass centres", columns, rows, size=8)


def torques(document: Document, content: Content) -> None:
    """Torques of a reference motion against the drives' limits, and gravity's share."""
    d = content.drawing("torques")
    top = max(d["torque_share"])
    if top > 1:
        title = f"A motion at full speed needs {100 * top:.0f} % of a drive's torque"
    else:
        title = f"A motion at full speed needs at most {100 * top:.0f} % of any drive's torque"
    page = document.page(title)
    axis = page.axes(190, above=30)
    bands = content.drawing("torque_bands")
    figures.torque_curves(axis, d["time"], d["tau"], d["limit"], d["names"], bands["half"])
    status = ", ".join(sorted({j.provenance.of("torque_nm").status for j in content.data.joints}))
    start, end = (", ".join(f"{v:g}" for v in d[k]) for k in ("start_deg", "end_deg"))
    page.caption(
        f"From A = ({start}) to ({end}) deg in {d['time'][-1]:g} s along a quintic, with "
        f"{d['payload_kg']:g} kg at {', '.join(f'{v:g}' for v in d['com_mm'])} mm of the flange, "
        f"rotor inertia and friction counted; marks: the largest. Status of the limits: {status}. "
        + _banded(bands)
    )
    half = FULL / 2
    bars = page.axes(170, LEFT + 26, LEFT + half - 22, move=False)
    figures.bars(bars, d["names"], {"torque": d["torque_share"], "speed": d["speed_share"]}, 1.0)
    bars.set_xlabel("largest / limit (dashed: limit)")
    bars.set_title("Headroom of each joint")
    bars.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    heat = page.axes(170, LEFT + half + 34, RIGHT - 24)
    figures.heat_map(
        heat, d["a2_deg"], d["a3_deg"], d["gravity_share"], ("A2, deg", "A3, deg"),
        "Holding torque: largest |G| / limit",
    )  # fmt: skip
    heat.set_xticks(range(-150, 50, 50))
    page.y += 12
    page.caption(
        "Map: other joints at 0, the same load, over the ranges of A2 and A3; n = "
        f"{d['gravity_share'].size:,}."
    )


def _banded(bands: Drawing) -> str:
    words, share = str(bands["words"]), bands["largest_share"]
    more = "" if share is None else f" Torque and band together: at most {100 * share:.0f} %."
    return f"{words[0].upper()}{words[1:]}.{more}"


def orders(document: Document, content: Content) -> None:
    """Error against step of the fixed-step integrators."""
    r = content.result("simulation.order")
    results = content.of("simulation")
    title = headline(
        results, "Integrators have the order they claim, and motions agree with Lagrange's",
        "simulation",
    )  # fmt: skip
    page = document.page(title)
    axis = page.axes(200, LEFT + 50)
    f = r.figures
    figures.order_curves(
        axis,
        [
            ("Runge-Kutta", f["Runge-Kutta step"], f["Runge-Kutta error"], 4.0),
            ("Euler", f["Euler step"], f["Euler error"], 1.0),
        ],
    )
    axis.set_title(f"Error of a motion: {r.title.lower()}")
    page.caption(
        f"{r.regime}; {r.method}. Found {r.evidence}: off by at most {r.error:.2g} of the order "
        f"(tolerance {r.tolerance:g}). Start of every check of this suite: {_start(content)}."
        if r.error is not None
        else r.evidence
    )
    claims(document, page, title, results)


def _start(content: Content) -> str:
    worst = next((r for r in content.of("simulation") if r.worst.get("q_deg")), None)
    return "see the list of cases" if worst is None else f"seed {worst.seed}"


def energy(document: Document, content: Content) -> None:
    """Drift of energy and the effect of tighter tolerances."""
    r = content.result("simulation.energy")
    held = "Without torques and friction the arm keeps its energy"
    page = document.page(headline([r], held, "energy"))
    axis = page.axes(226, LEFT + 50, below=46)
    figures.history(
        axis, r.figures["time"], [("drift of T + P", r.figures["drift"])], r.tolerance,
        "|drift| / largest T",
    )  # fmt: skip
    axis.set_title("Energy no work explains, relative; a measure of the solver, not of accuracy")
    page.caption(f"{r.regime}; {r.method}; {sampled(r)}. {worst_point(r)}")
    other = next((x for x in content.of("simulation") if x.id == "simulation.tolerance"), None)
    if other is not None and other.figures:
        axis = page.axes(186, LEFT + 50, below=46)
        figures.history(
            axis, other.figures["time"], [("largest joint difference", other.figures["gap"])],
            other.tolerance, "difference, rad",
        )  # fmt: skip
        axis.set_title(other.title)
        page.caption(f"{other.regime}; {other.method}; {sampled(other)}. {worst_point(other)}")


def engines(document: Document, content: Content) -> None:
    """Other people's engines on the same numbers."""
    results = content.of("engines")
    ran = [r for r in results if r.status != "skipped"]
    ours = [r for r in ran if r.grade == "D"]
    others = [r for r in ran if r.grade != "D"]
    names = sorted({r.title.partition(":")[0] for r in others})
    if not results:
        raise LackingError("the results hold no case of the suite engines")
    claim = f"{_listed(names)} agree: same numbers, other code" if others else "No other engine ran"
    title = headline(ran or results, claim, "other engines")
    page = document.page(title)
    curves = [
        (r.title.partition(":")[0], r)
        for r in ran
        if r.id.endswith(".motion") and len(r.figures.get("time", ())) > 1
    ]
    if curves:
        axis = page.axes(166, LEFT + 50, below=46)
        figures.history(
            axis, curves[0][1].figures["time"],
            [(name, r.figures["gap"]) for name, r in curves], curves[0][1].tolerance,
            "difference, rad",
        )  # fmt: skip
        axis.set_title("Difference of a simulated motion, largest of six joints")
        page.caption(f"{curves[0][1].regime}. {worst_point(curves[0][1])}")
    if others:
        page = claims(document, page, title, others)
    if ours:
        page = document.with_room(page, 120, title)
        page.heading("The compiled kernels")
        page.paragraph(
            "Not independent: they are printed from the same model, so this compares the work of "
            "printer and compiler with the source."
        )
        page = claims(document, page, title, ours)
    reasons = sorted({r.evidence for r in results if r.status == "skipped"})
    page.bullets([f"skipped: {reason}" for reason in reasons], size=8)


def _listed(names: list[str]) -> str:
    *first, last = names or ["Nothing"]
    return f"{', '.join(first)} and {last}" if first else last


def run(document: Document, content: Content) -> None:
    """A recorded motion, if one was given."""
    recorded = content.evidence.run
    if recorded is None:
        raise LackingError("no run was given; kr16 simulate -o RUN.npz makes one")
    with rc_context({"axes.titley": None, "axes.titlelocation": "center"}):  # as they are made for
        drawn = (
            motion_figures.joint_figure(
                recorded, content.data.joints, Bands(**content.drawing("run_bands"))
            ),
            motion_figures.flange_figure(recorded),
        )
    for figure in drawn:
        figure.suptitle("")  # the page has its own title
        layout = figure.get_layout_engine()
        if layout is not None:
            bottom, top = 88 / HEIGHT, 1 - 88 / HEIGHT
            layout.set(rect=(0.05, bottom, 0.9, top - bottom))  # type: ignore[call-arg]
        for legend in figure.legends:
            legend.set_bbox_to_anchor((0.5, 44 / HEIGHT), transform=figure.transFigure)
        state = "" if recorded.complete else f", INCOMPLETE: {recorded.failure or recorded.stopped}"
        document.adopt(figure, f"Recorded motion {recorded.scenario['name']}{state}")
