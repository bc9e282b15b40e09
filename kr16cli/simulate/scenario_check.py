"""The rules of a scenario file, schema kr16.scenario/1.

`problems_in` walks a parsed table and lists every broken rule, each as one ParameterError with
the key, the value and the rule. It never raises, whatever the table holds.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from kr16cli.errors import ParameterError
from kr16cli.robot import Inertia6
from kr16cli.robot_rules import GRAVITY, INERTIA, LENGTH, MASS, Quantity, inertia_problem
from kr16cli.simulate.motion_spec import FOLLOWERS, MotionChecker

SCHEMA = "kr16.scenario/1"
METHODS = ("auto", "DOP853", "RK45", "Radau", "LSODA")
FIXED = ("RK4", "SemiImplicitEuler")
KINDS = ("zero", "constant", "gravity", "csv")
MOST_SAMPLES = 1_000_000
DEFAULT_STEP = 0.01

DURATION = Quantity("durations", "s", 86_400.0, "ms", 0.0, True)
OUTPUT_STEP = Quantity("output steps", "s", 86_400.0, "ms", 0.0, True)
ANGLE_DEG = Quantity("angles", "deg", 720.0)
SPEED_DEG_S = Quantity("speeds", "deg/s", 1e5)
ANGLE = Quantity("angles", "rad", 12.6, "degrees")
SPEED = Quantity("speeds", "rad/s", 1800.0)
TORQUE = Quantity("torques", "N m", 1e6, "N mm")
SOLVER = {
    # Below 2.3e-14 SciPy refuses a relative tolerance: it is no more than rounding.
    "rtol": Quantity("relative tolerances", "", 0.1, low=1e-13),
    "atol": Quantity("absolute tolerances", "", 0.1, low=1e-15),
}
STEP = Quantity("steps", "s", 0.1, "ms", 0.0, True)
_INITIAL = {"q": ANGLE, "q_deg": ANGLE_DEG, "qd": SPEED, "qd_deg_s": SPEED_DEG_S}
_GROUPS = ("initial", "torque", "payload", "limits", "wrench", "controller", "reference", "solver")
_OPTIONAL = ("description", "output_step_s", "drives", "gravity", *_GROUPS[1:])
_TORQUE_KEYS = {"constant": "tau_nm", "csv": "file"}


def problems_in(table: Mapping[str, Any], path: str) -> list[ParameterError]:
    """Every broken rule of a parsed scenario file, in the order of the format.

    Args:
        table: what tomllib returns, or a mapping of the same shape.
        path: what messages call the file.
    """
    checker = _ScenarioChecker(path)
    checker.scenario(table)
    return checker.found


class _ScenarioChecker(MotionChecker):
    """Collects problems; every method takes the dotted key of what it looks at."""

    def scenario(self, table: Mapping[str, Any]) -> None:
        if not self.is_table(table, "scenario"):
            return
        self.keys(table, "", ("schema", "name", "duration_s", "initial"), _OPTIONAL)
        self.choice(table, "", "schema", (SCHEMA,))
        self.text(table, "", "name")
        self.text(table, "", "description")
        self.times(table)
        self.numbers(table, "", "gravity", [GRAVITY] * 3)
        if not isinstance(table.get("drives", False), bool):
            self.fail("drives", table["drives"], "must be true or false")
        for name in _GROUPS:
            if name in table and self.is_table(table[name], name):
                getattr(self, name)(table[name])
        self.together(table)

    def together(self, table: Mapping[str, Any]) -> None:
        """Groups that contradict or need one another."""
        controller, reference = table.get("controller"), table.get("reference")
        if controller is not None and "torque" in table:
            self.fail("torque", table["torque"], "stands beside [controller]; give one")
        kind = controller.get("kind") if isinstance(controller, Mapping) else None
        if reference is not None and (controller is None or kind in ("zero", "gravity")):
            what = (
                "needs a [controller] that follows it"
                if controller is None
                else (f'means nothing to the controller "{kind}"')
            )
            self.fail("reference", reference, what)
        if reference is None and kind in FOLLOWERS:
            self.fail("reference", None, f'controller "{kind}" needs it; kind = "hold" stays')

    def times(self, table: Mapping[str, Any]) -> None:
        """The duration, the output step, and how many samples they make."""
        if "duration_s" not in table:
            return
        duration = self.one_number(table["duration_s"], "duration_s", DURATION)
        given = table.get("output_step_s", DEFAULT_STEP)
        step = self.one_number(given, "output_step_s", OUTPUT_STEP)
        if duration is None or step is None:
            return
        if step > duration and "output_step_s" in table:
            self.fail("output_step_s", step, f"must not exceed duration_s = {duration:g}")
        elif duration / step > MOST_SAMPLES:
            rule = f"makes {duration / step:.3g} samples, more than {MOST_SAMPLES}; make it longer"
            self.fail("output_step_s", step, rule)

    def initial(self, table: Mapping[str, Any]) -> None:
        self.keys(table, "initial", (), tuple(_INITIAL))
        for key, quantity in _INITIAL.items():
            self.numbers(table, "initial", key, [quantity] * 6)
        if "q" not in table and "q_deg" not in table:
            self.fail("initial.q_deg", None, "the start needs six joint angles")
        for key, other in (("q", "q_deg"), ("qd", "qd_deg_s")):
            if key in table and other in table:
                self.fail(f"initial.{key}", table[key], f"stands beside {other}; give one")

    def torque(self, table: Mapping[str, Any]) -> None:
        self.keys(table, "torque", ("kind",), tuple(_TORQUE_KEYS.values()))
        self.choice(table, "torque", "kind", KINDS)
        self.numbers(table, "torque", "tau_nm", [TORQUE] * 6)
        self.text(table, "torque", "file")
        kind = table.get("kind")
        for owner, key in _TORQUE_KEYS.items():
            if kind == owner and key not in table:
                self.fail(f"torque.{key}", None, f'kind = "{owner}" needs it')
            if kind != owner and kind in KINDS and key in table:
                rule = f'belongs to kind = "{owner}", not to "{kind}"'
                self.fail(f"torque.{key}", table[key], rule)

    def payload(self, table: Mapping[str, Any]) -> None:
        self.keys(table, "payload", ("mass",), ("com", "inertia"))
        self.number(table, "payload", "mass", MASS)
        self.numbers(table, "payload", "com", [LENGTH] * 3)
        inertia = self.numbers(table, "payload", "inertia", [INERTIA] * 6)
        rule = inertia_problem(cast("Inertia6", tuple(inertia))) if inertia else None
        if rule:
            self.fail("payload.inertia", table["inertia"], f"{rule}; a point load has none")

    def solver(self, table: Mapping[str, Any]) -> None:
        self.keys(table, "solver", (), ("method", *SOLVER, "step_s", "max_steps"))
        self.choice(table, "solver", "method", METHODS + FIXED)
        self.number(table, "solver", "step_s", STEP)
        for key, quantity in SOLVER.items():
            self.number(table, "solver", key, quantity)
            if key in table and table.get("method") in FIXED:
                self.fail(f"solver.{key}", table[key], "means nothing to a fixed step; give step_s")
        if "step_s" in table and table.get("method", "auto") in METHODS:
            self.fail("solver.step_s", table["step_s"], f"belongs to {' or '.join(FIXED)}")
        steps = table.get("max_steps", 1)
        if not isinstance(steps, int) or isinstance(steps, bool) or steps < 1:
            self.fail("solver.max_steps", steps, "must be a whole number of 1 or more")
