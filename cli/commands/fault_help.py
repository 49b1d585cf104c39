"""How a fault is written on the command line, for the help of the commands that take one."""

FAULT_FORM = """\b
A fault is PART SIDE MODE START STOP [eps=] [sat=] [std=] [tau=] [ramp=]: PART a wheel (FR FL RR RL) or
steering axle (front rear); SIDE sensor or actuator, which is the valve or drive; START and STOP in s.
MODE  stuck        stays at sat, or where it was at START
      no_signal    dead: a sensor reads 0, a valve does not open
      inefficient  loses the share eps of what it should be: eps=0.4 leaves 60 %
      noisy        loses eps, and has noise of mean sat and standard deviation std added
sat and std are in m/s (speed), rad (angle) or fraction of full opening (valve); tau is the noise's
correlation time in s; ramp the time in s over which eps grows from 0."""
