"""Evidence of single drives: the speed that an effort implies, extra effort, command tracking."""
