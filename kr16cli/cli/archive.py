"""Answers of a batch as one npz file: an array per quantity, one entry per row."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping, Sequence
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from kr16cli.cli import sinks
from kr16cli.queries.common import Question
from kr16cli.robot import RobotData

Array = NDArray[np.float64]


class _Column:
    """An array that grows; what is not given is NaN."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.shape = shape
        self._numbers = sinks.Spool()
        self._rows = 0

    def append(self, rows: Array) -> None:
        """Add rows (n, *shape)."""
        numbers = np.ascontiguousarray(rows, dtype="<f8").reshape(-1)
        self._numbers.write(numbers.view(np.uint8).data)
        self._rows += len(rows)

    def fill(self, rows: int) -> None:
        """Add NaN up to so many rows."""
        for _ in range(self._rows, rows, 4096):
            self.append(np.full((min(4096, rows - self._rows), *self.shape), np.nan))

    def write(self, out: IO[bytes]) -> None:
        """The array as a npy file."""
        shape = (self._rows, *self.shape)
        npy.write_array_header_1_0(out, {"descr": "<f8", "fortran_order": False, "shape": shape})
        self._numbers.pour(out)

    def close(self) -> None:
        """Let go of the numbers."""
        self._numbers.close()


class NpzSink:
    """Rows as numbers; a row without an answer is NaN and says so in `status`."""

    def __init__(self, question: Question, data: RobotData) -> None:
        self._question, self._data = question, data
        self._columns: dict[str, _Column] = {}
        self._words: dict[str, int] = {}
        self._statuses = bytearray()

    def _column(self, name: str, shape: tuple[int, ...]) -> _Column:
        column = self._columns.get(name)
        if column is None:
            column = self._columns[name] = _Column(shape)
        column.fill(len(self._statuses))
        return column

    def _status(self, word: str) -> int:
        return self._words.setdefault(word, len(self._words))

    def add(self, told: sinks.Told) -> None:
        """Take a row's numbers."""
        for name, value in self._numbers(told).items():
            self._column(name, value.shape).append(value[None])
        self._statuses.append(self._status(told.status))

    def _numbers(self, told: sinks.Told) -> dict[str, Array]:
        if told.answer is None:
            return {}
        given = self._question.arrays(told.answer.result)
        return {name: np.array(value, dtype=float) for name, value in given.items()}

    def add_block(self, answered: sinks.Answered) -> None:
        """Take the numbers of rows."""
        told = {i: self._numbers(row) for i, row in answered.told.items()}
        for name, array in answered.many.arrays.items():
            rows = array
            if told:
                rows = np.full((answered.size, *array.shape[1:]), np.nan)
                rows[answered.sound] = array
                for i, numbers in told.items():
                    rows[i] = numbers.get(name, np.nan)
            self._column(name, array.shape[1:]).append(rows)
        words = bytearray([self._status("ok")]) * answered.size
        for i, row in answered.told.items():
            words[i] = self._status(row.status)
        self._statuses += words

    def write(self, out: IO[bytes], inputs: Mapping[str, Any], warnings: Sequence[str]) -> None:
        """The npz file, with units, robot, model hash and warnings as text."""
        used = sorted(set(self._statuses))
        words = np.array([word for word, i in self._words.items() if i in used], dtype=np.str_)
        places = np.zeros(256, dtype=np.intp)
        places[used] = np.arange(len(used))
        texts = {
            "status": words[places[np.frombuffer(self._statuses, dtype=np.uint8)]],
            "units": np.array(json.dumps(self._question.units)),
            "robot": np.array(self._data.name),
            "model_sha256": np.array(self._data.sha256),
            "warnings": np.array("\n".join(warnings)),
        }
        with zipfile.ZipFile(out, "w") as archive:
            for name, column in self._columns.items():
                column.fill(len(self._statuses))
                with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                    column.write(file)
            for name, text in texts.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                    npy.write_array(file, text, allow_pickle=False)

    def close(self) -> None:
        """Let go of what was collected."""
        for column in self._columns.values():
            column.close()
