"""The robot as a file for other programs: `urdf.urdf` (ROS, Pinocchio), `mjcf.mjcf` (MuJoCo)."""
