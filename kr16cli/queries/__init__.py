"""The questions of the command line: typed values in, plain JSON-ready dictionaries out.

Nothing here prints, reads files or imports NumPy. Values arrive as typed (mm and degrees, or
SI with `si`); the model runs in SI; each question names the units of what it returns.
"""
