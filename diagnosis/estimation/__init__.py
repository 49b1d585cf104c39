"""The paper's fault tables as Kalman models, the most probable path, segments, fault size."""
