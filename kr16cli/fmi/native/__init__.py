"""Native FMUs: FMI 2.0 and 3.0, co-simulation and model exchange, no Python on the target.

`traced` and `cwrite` print the model as C, `slots` and `numbers` describe variables and the
robot to the hand-written C in fmu/native, `describe2` and `describe3` write the model
descriptions, `documents`, `references` and `terminals` what else lies in an FMU, `toolchain`
compiles, `build` packs. `track` and `track_fmu` make the trajectory source of fmu/track, `ssp` a
system of it, a controller and the robot.
"""
