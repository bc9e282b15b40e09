"""FMUs of the robot: build, look into, check and run them.

`variables`, `machine`, `portable` and `description` travel inside an FMU with the parts of
the package they need (`stage`); the rest runs here: `build`, `reading`, `check`, `play`.
"""
