"""Kinematics, the MFHCA law and the loop replayed open-loop."""
