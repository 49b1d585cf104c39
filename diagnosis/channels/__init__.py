"""What one channel shows alone: liveness, status of samples, noise, gaps."""
