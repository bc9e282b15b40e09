"""Chapter 3 as code, generic in the scalar: floats, arrays, fractions, mpmath, symbols.

Joint angles enter as pairs (cosine, sine), so everything but inverse kinematics and friction
needs only + - * /. The robot's numbers are arguments; no number of one robot is written here.
Frames: `robroot` (x forward, z up) and `flange` at every boundary; the chapter's base b and
DH frames 0..6 inside `chain`.
"""
