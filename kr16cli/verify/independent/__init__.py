"""A second model of the arm, for evidence of grade B: other methods, nothing of `kr16cli.model`.

Kinematics is a product of exponentials about the joint axes of the zero pose, or the literal
matrix product of Table 3.1; derivatives are complex steps; dynamics is Lagrange's, from the sum
over links; inverse kinematics is Pieper's quartic, or Newton from many starts. A test holds that
no file here imports the model.
"""
