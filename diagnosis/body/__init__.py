"""What sensors of the body say of the speed at which the wheels roll."""
