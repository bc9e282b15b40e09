"""Motions of the robot under joint torques.

A `Scenario` says what happens (`scenario`, with `motion_spec` for controllers and references),
`experiment.simulate` lets it happen, a `Run` holds what was seen (`run`), `summary` says it in a
few numbers. `plant`, `controllers`, `task_control` and `loop` are the closed loop on plain
floats, agreed upon in `core`; they know nothing of solvers. `references` and `paths` are the
motions that are wanted. `integrate` and `fixed` know nothing of robots. `evidence` holds
motions whose course is known.
"""
