"""Native FMUs: FMI 2.0 and 3.0, co-simulation and model exchange, no Python on the target.

`traced` and `cwrite` print the model as C, `slots` and `numbers` describe variables and the
robot to the hand-written C in fmu/native, `describe` writes the model descriptions, `toolchain`
compiles, `build` packs.
"""
