"""Evidence of single drives: the controller's effort, command tracking."""
