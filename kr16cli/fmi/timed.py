"""FMUs in FMPy inside this process, to be timed."""

from __future__ import annotations

import shutil
from pathlib import Path


def run(path: Path, stop: float, step: float) -> None:
    """Simulate from 0 to `stop` (s), all outputs recorded every `step` (s)."""
    import fmpy

    fmpy.simulate_fmu(str(path), validate=False, stop_time=stop, output_interval=step)


class Slave:
    """An instance of an FMI 2.0 FMU of a robot, initialized; its calls are FMPy's, in `fmu`.

    Args:
        path: the FMU.
        mode: control.mode; references stand where it starts.
        step: communication step, s.
        exchange: of model exchange, not of co-simulation.
    """

    def __init__(self, path: Path, mode: int, step: float, *, exchange: bool = False) -> None:
        import fmpy
        from fmpy.fmi2 import FMU2Model, FMU2Slave

        description = fmpy.read_model_description(str(path), validate=False)
        self._folder = fmpy.extract(str(path))
        part = description.modelExchange if exchange else description.coSimulation
        self.token = description.guid
        self.fmu = (FMU2Model if exchange else FMU2Slave)(
            guid=description.guid, unzipDirectory=self._folder, instanceName="timed",
            modelIdentifier=part.modelIdentifier,
        )  # fmt: skip
        self.fmu.instantiate()
        known = {v.name: v for v in description.modelVariables}
        self.fmu.setInteger([known["control.mode"].valueReference], [mode])
        wanted = [known[f"q_ref[{i}]"].valueReference for i in range(1, 7)]
        self.fmu.setReal(wanted, [float(known[f"q_start[{i}]"].start) for i in range(1, 7)])
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.time, self._step = 0.0, step

    def steps(self, count: int) -> None:
        """So many steps, by as many calls from Python."""
        for k in range(count):
            self.fmu.doStep(self.time + k * self._step, self._step)
        self.time += count * self._step

    def __enter__(self) -> Slave:
        return self

    def __exit__(self, *_: object) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()
        shutil.rmtree(self._folder, ignore_errors=True)
