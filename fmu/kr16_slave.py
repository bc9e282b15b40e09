"""The slave that pythonfmu's wrapper loads: calls go to a `Machine`, errors to the host's log.

This file travels in the FMU; its imports of kr16cli are then those of the private copy it is
part of.
"""

import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from os import environ
from typing import Any
from xml.etree.ElementTree import Element

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from kr16cli.errors import InputError
from kr16cli.fmi import slave_side


class KR16(Fmi2Slave):
    """The robot as a slave of FMI 2.0."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        if "logger" in kwargs:  # the wrapper's call: its entry in the path is needed no more
            with suppress(ValueError):
                sys.path.remove(kwargs["resources"])
        self._machine = slave_side.new_machine(self._warn)

    def _warn(self, text: str) -> None:
        self.log(text, Fmi2Status.warning)

    def _try(self, work: Callable[..., Any], *args: Any) -> Any:
        """The work's result; an error is logged and told to the wrapper."""
        try:
            return work(*args)
        except Exception as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            self.log(reason, Fmi2Status.error)
            slave_side.keep(type(self), self, self.log_queue)
            raise InputError(reason) from None

    def to_xml(self, model_options: Any = None) -> Element:
        """The model description."""
        from kr16cli.fmi.description import model_description

        about, identity = slave_side.about()
        epoch = environ.get("SOURCE_DATE_EPOCH")
        now = datetime.now(UTC)
        made = datetime.fromtimestamp(int(epoch), UTC) if epoch else now
        date = made.strftime("%Y-%m-%dT%H:%M:%SZ")
        return model_description(self.modelName, identity, date, about, slave_side.variables())

    def setup_experiment(
        self, start_time: float, stop_time: float | None, tolerance: float | None
    ) -> None:
        """The times of the experiment."""
        self._try(self._machine.setup, start_time, stop_time, tolerance)

    def enter_initialization_mode(self) -> None:
        """Begin the initialization."""
        self._try(self._machine.enter)

    def exit_initialization_mode(self) -> None:
        """End the initialization."""
        self._try(self._machine.leave)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Move by one communication step."""
        self._try(self._machine.step, current_time, step_size)
        return True

    def terminate(self) -> None:
        """End the simulation."""
        self._try(self._machine.terminate)

    def get_real(self, vrs: Sequence[int]) -> list[float]:
        """Values of any type as numbers: some hosts read Booleans so."""
        return self._try(self._read, vrs, ("Real", "Integer", "Boolean"), float)

    def get_integer(self, vrs: Sequence[int]) -> list[int]:
        """Integers and Booleans."""
        return self._try(self._read, vrs, ("Integer", "Boolean"), int)

    def get_boolean(self, vrs: Sequence[int]) -> list[bool]:
        """Booleans."""
        return self._try(self._read, vrs, ("Boolean",), bool)

    def get_string(self, vrs: Sequence[int]) -> list[str]:
        """Texts, of which there are none."""
        return self._try(self._read, vrs, ("String",), str)

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        """Set Reals."""
        self._try(self._write, vrs, values, "Real")

    def set_integer(self, vrs: Sequence[int], values: Sequence[int]) -> None:
        """Set Integers."""
        self._try(self._write, vrs, values, "Integer")

    def set_boolean(self, vrs: Sequence[int], values: Sequence[bool]) -> None:
        """Set Booleans."""
        self._try(self._write, vrs, values, "Boolean")

    def set_string(self, vrs: Sequence[int], values: Sequence[str]) -> None:
        """Set texts, of which there are none."""
        self._try(self._write, vrs, values, "String")

    def _read(self, vrs: Sequence[int], bases: Sequence[str], kind: type) -> list[Any]:
        return list(map(kind, self._machine.get(vrs, bases)))

    def _write(self, vrs: Sequence[int], values: Sequence[Any], base: str) -> None:
        self._machine.set(vrs, values, (base,))

    def _get_fmu_state(self) -> dict[str, Any]:
        return self._try(self._machine.save)

    def _set_fmu_state(self, state: Any) -> None:
        self._try(self._machine.restore, state)

    @staticmethod
    def _fmu_state_to_bytes(state: Any) -> bytes:
        return slave_side.to_bytes(state)

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> Any:
        return slave_side.from_bytes(state)
