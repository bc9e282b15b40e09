"""`Robot` as a Python object: pickling, copying, names and words of its methods, memory."""

from __future__ import annotations

import copy
import gc
import inspect
import pickle
import weakref

import numpy as np
import pytest

from kr16cli import Robot, load_robot
from kr16cli.errors import Kr16Error


def test_a_robot_survives_pickling_and_copying() -> None:
    robot = load_robot(drives=True).with_payload(12.0).with_tool(np.eye(4))
    again = pickle.loads(pickle.dumps(robot))
    q = np.linspace(-0.5, 0.9, 6)
    for other in (again, copy.deepcopy(robot)):
        assert repr(other) == repr(robot)
        np.testing.assert_array_equal(other.mass_matrix(q), robot.mass_matrix(q))
        np.testing.assert_array_equal(other.fk(q), robot.fk(q))


def test_methods_answered_by_kernels_keep_their_names_and_words() -> None:
    robot = load_robot()
    assert robot.fk.__name__ == "fk"
    assert robot.fk.__doc__ == Robot.fk.__doc__
    assert "threads" in inspect.signature(robot.fk).parameters
    q = np.linspace(-0.5, 0.9, 6)
    np.testing.assert_array_equal(robot.fk(q=q), robot.fk(q))
    np.testing.assert_array_equal(robot.fk(q.tolist()), robot.fk(q))
    with pytest.raises(Kr16Error, match="qd"):
        robot.jacobian_dot(q, None)


def test_robots_are_freed() -> None:
    robot = load_robot().with_payload(3.0)
    gone = weakref.ref(robot)
    del robot
    gc.collect()
    assert gone() is None
