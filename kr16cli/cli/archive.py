"""Answers of a batch as one npz file: an array per quantity, one entry per row."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kr16cli.queries.common import Answer, Question
from kr16cli.robot import RobotData


class NpzSink:
    """Rows as numbers; a row without an answer is NaN and says so in `status`."""

    def __init__(self, question: Question, data: RobotData) -> None:
        self._question, self._data = question, data
        self._rows: list[dict[str, NDArray[np.float64]] | None] = []
        self._statuses: list[str] = []

    def add(self, answer: Answer | None, status: str, reason: str | None) -> None:
        """Take a row's numbers."""
        given = None if answer is None else self._question.arrays(answer.result)
        self._rows.append(given and {name: np.array(v, dtype=float) for name, v in given.items()})
        self._statuses.append(status)

    def content(self, inputs: Mapping[str, Any], warnings: Sequence[str]) -> bytes:
        """The npz file, with units, robot, model hash and warnings as text."""
        shapes = {name: v.shape for row in self._rows if row for name, v in row.items()}
        arrays: dict[str, Any] = {}
        for name, shape in shapes.items():
            arrays[name] = np.full((len(self._rows), *shape), np.nan)
            for i, row in enumerate(self._rows):
                if row and name in row:
                    arrays[name][i] = row[name]
        arrays["status"] = np.array(self._statuses, dtype=np.str_)
        for name, text in (
            ("units", json.dumps(self._question.units)),
            ("robot", self._data.name),
            ("model_sha256", self._data.sha256),
            ("warnings", "\n".join(warnings)),
        ):
            arrays[name] = np.array(text)
        out = BytesIO()
        np.savez(out, **arrays)
        return out.getvalue()
