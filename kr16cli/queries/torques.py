"""kr16 dynamics: M, C, G, torques or accelerations, energy and the load on the foundation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from kr16cli.errors import InputError, NoAnswerError
from kr16cli.queries.common import Answer, Question, flat, plain
from kr16cli.robot import Payload, RobotData, Vector3
from kr16cli.single import Arm

if TYPE_CHECKING:
    from kr16cli.queries.many import Many

_ZEROS = (0.0,) * 6
_UNITS = {
    "mass_matrix": "kg m2",
    "coriolis_matrix": "kg m2/s",
    "gravity": "N m",
    "friction": "N m",
    "torque": "N m",
    "acceleration": "rad/s2",
    "energy": "J",
    "base_wrench": "N, N m",
    "christoffel": "kg m2",
    "task": "SI, x = (p in m, roll, pitch, yaw in rad)",
}


class DynamicsQuestion(Question):
    """Dynamics; results are SI always.

    Args:
        data: the robot.
        si: typed angles, speeds and accelerations in rad.
        qd: joint speeds as typed; None: at rest.
        qdd: joint accelerations as typed; asks for the torque.
        tau: joint torques, N m; asks for the acceleration.
        payload: load at the flange.
        drives: count rotor inertia and friction.
        gravity: gravity in robroot, m/s2; None: the file's.
        task: add the task-space forms (3.6).
        christoffel: add the matrices C_k of (3.41).
    """

    name = "dynamics"
    optional = ("qd", "qdd", "tau")

    def __init__(
        self,
        data: RobotData,
        *,
        si: bool = False,
        qd: Sequence[float] | None = None,
        qdd: Sequence[float] | None = None,
        tau: Sequence[float] | None = None,
        payload: Payload | None = None,
        drives: bool = False,
        gravity: Sequence[float] | None = None,
        task: bool = False,
        christoffel: bool = False,
    ) -> None:
        super().__init__(data, si=si)
        if not data.links:
            raise InputError(
                f"{data.name} has no inertial data (0 of 6 links in {data.path}); dynamics needs "
                "a file with six [[link]] groups"
            )
        if gravity is not None:
            x, y, z = gravity
            data = data.with_gravity((x, y, z))
        self.arm = Arm(data, payload=payload, drives=drives)
        self.typed = {"qd": qd, "qdd": qdd, "tau": tau}
        self.payload, self.drives = payload, drives
        self.task, self.christoffel = task, christoffel
        self.column_units: dict[str, str] = {}
        self.units = {"q": self.angle_unit, **_UNITS}
        given: dict[str, Any] = {
            **self.typed,
            "payload": None if payload is None else _payload_text(payload),
            "drives": drives,
            "gravity": list(data.gravity),
        }
        self.options = {key: value for key, value in given.items() if value is not None}

    def answer(self, values: Mapping[str, Any]) -> Answer:
        """Dynamics at `values["q"]`; qd, qdd and tau of the row come before the options."""
        arm, q = self.arm, self.radians(values["q"])
        typed = {**self.typed, **{k: values[k] for k in self.optional if k in values}}
        qd = list(_ZEROS) if typed["qd"] is None else self.radians(typed["qd"])
        result: dict[str, Any] = {
            "mass_matrix": plain(arm.mass_matrix(q)),
            "coriolis_matrix": plain(arm.coriolis_matrix(q, qd)),
            "gravity": plain(arm.gravity(q)),
        }
        if self.drives:
            result["friction"] = plain(arm.friction(qd))
        qdd = list(_ZEROS)
        moving = "at rest, qdd = 0" if typed["qd"] is None else "qdd = 0"
        if typed["tau"] is not None:
            qdd, moving = arm.forward_dynamics(q, qd, typed["tau"]), "the acceleration from tau"
            result["acceleration"] = plain(qdd)
        if typed["qdd"] is not None:
            qdd, moving = self.radians(typed["qdd"]), "the given qdd"
            result["torque"] = plain(arm.inverse_dynamics(q, qd, qdd))
        kinetic, potential = arm.energy(q, qd)
        result["energy"] = {"kinetic": plain(kinetic), "potential": plain(potential)}
        result["base_wrench"] = plain(arm.base_wrench(q, qd, qdd))
        result["base_wrench_of"] = moving
        if self.christoffel:
            result["christoffel"] = plain(arm.christoffel(q))
        warnings = self.warnings(q, result)
        if self.task:
            try:
                result["task"] = {k: plain(v) for k, v in arm.task_space(q, qd)._asdict().items()}
            except NoAnswerError as error:
                result |= {"task": None, "task_reason": str(error)}
                warnings.append(str(error))
        return Answer(result, warnings)

    def warnings(self, q: Sequence[float], result: Mapping[str, Any]) -> list[str]:
        """Joints outside their limits, and what exceeds the robot's ratings."""
        return self.limit_warnings(q) + self.load_warnings(result)

    def takes_many(self, kind: str) -> bool:
        """Dynamics in task space are asked row by row."""
        return super().takes_many(kind) and not self.task

    def many(self, values: Mapping[str, Any]) -> Many:
        """Dynamics for `values["q"]`, and `values` of qd, qdd and tau, (n, 6) each."""
        from kr16cli.queries.many_rates import dynamics

        return dynamics(self, values)

    def load_warnings(self, result: Mapping[str, Any]) -> list[str]:
        """What exceeds the robot's ratings: payload and torque."""
        texts = []
        rated = self.data.ratings.get("payload_kg")
        if self.payload is not None and rated is not None and self.payload.mass > rated:
            texts.append(f"payload {self.payload.mass:g} kg exceeds the rated {rated:g} kg")
        for joint, torque in zip(self.data.joints, result.get("torque", _ZEROS), strict=True):
            if joint.torque is not None and abs(torque) > joint.torque:
                texts.append(
                    f"{joint.name} needs {abs(torque):.4g} N m, more than its {joint.torque:g} N m"
                )
        return texts

    @property
    def csv_units(self) -> str:
        """SI, whatever was typed."""
        return "kg m s rad"

    def columns(self, result: Mapping[str, Any] | None) -> dict[str, Any]:
        """gravity_1.., energies, base_wrench_1.., m_11.., c_11...

        Where asked for friction_1.., torque_1.., acceleration_1.. after gravity.
        """
        r = result or {}
        six, square = [None] * 6, [[None] * 6 for _ in range(6)]
        row = flat("gravity", r.get("gravity", six))
        if self.drives:
            row |= flat("friction", r.get("friction", six))
        for name, asked in (("torque", "qdd"), ("acceleration", "tau")):
            if name in r or self.typed[asked] is not None:
                row |= flat(name, r.get(name, six))
        energy = r.get("energy", {})
        row |= {f"energy_{kind}": energy.get(kind) for kind in ("kinetic", "potential")}
        row |= flat("base_wrench", r.get("base_wrench", six))
        row |= flat("m", r.get("mass_matrix", square))
        return row | flat("c", r.get("coriolis_matrix", square))

    @property
    def beyond_columns(self) -> dict[str, str]:
        """The matrices of the task space and C_k."""
        asked = {"--task": self.task, "--christoffel": self.christoffel}
        return {name: "it is in json and npz" for name, wanted in asked.items() if wanted}

    def arrays(self, result: Mapping[str, Any]) -> dict[str, Any]:
        """The vectors and matrices by name, and the two energies."""
        arrays = {key: value for key, value in result.items() if isinstance(value, list)}
        arrays |= {f"energy_{kind}": value for kind, value in result["energy"].items()}
        task = result.get("task") or {}
        return arrays | {f"task_{key}": value for key, value in task.items()}


def _payload_text(payload: Payload) -> dict[str, Any]:
    """The payload in SI, as it is used."""
    com: Vector3 = payload.com
    return {
        "mass_kg": payload.mass,
        "com_m": list(com),
        "inertia_kg_m2": list(payload.inertia),
    }
