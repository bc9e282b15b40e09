"""Answers of a batch as one npz file: an array per quantity, one entry per row."""

from __future__ import annotations

import json
from collections.abc import Sequence
from io import BytesIO
from typing import Any

import numpy as np

from kr16cli.queries.common import Answer, Question
from kr16cli.robot import RobotData


def npz_bytes(
    question: Question, data: RobotData, answers: Sequence[Answer | None], statuses: Sequence[str]
) -> bytes:
    """The npz file's content; rows without an answer are NaN and say so in `status`."""
    parts = [None if answer is None else question.arrays(answer.result) for answer in answers]
    names = list(dict.fromkeys(name for part in parts if part for name in part))
    arrays: dict[str, Any] = {}
    for name in names:
        given = [None if part is None else part.get(name) for part in parts]
        first = next(value for value in given if value is not None)
        array = np.full((len(given), *np.shape(first)), np.nan)
        for i, value in enumerate(given):
            if value is not None:
                array[i] = value
        arrays[name] = array
    arrays["status"] = np.array(list(statuses), dtype=np.str_)
    arrays["units"] = np.array(json.dumps(dict(question.units)))
    arrays["robot"] = np.array(data.name)
    arrays["model_sha256"] = np.array(data.sha256)
    out = BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()
