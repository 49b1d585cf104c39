"""What each drive's effort says beside its motion and its siblings' efforts."""
