"""Motions of the robot under joint torques.

A `Scenario` says what happens (`scenario`), `experiment.simulate` lets it happen, a `Run` holds
what was seen (`run`), `summary` says it in a few numbers. The plant and the torques that
drive it (`plant`, `torque`) know nothing of solvers; `integrate` knows nothing of robots.
"""
