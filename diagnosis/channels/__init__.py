"""What one channel tells alone: liveness, noise, repeats, gaps."""
