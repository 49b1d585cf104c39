"""Control laws of the wheels' valves beside the paper's own: one file per class, and the table of them.

The paper compares MFHCA with four controllers whose code, gains and machine are not public. What stands here are
representatives of their classes, with as many parameters as the paper's table counts, tuned on this project's simulator;
none of them is those authors' controller, and no figure made with them says anything about those authors' machines.

All laws share one form. A law sees the commanded speed v_c and the measured speed y of each wheel, and nothing else; with

    e = y − v_c

it gives a valve command u, clipped to ±u_max (1 is full opening). States are advanced by explicit Euler with the control
step, after the command was given; states that integrate are held while the command is clipped and the error would drive
it further (anti-windup). Everything starts at rest.
"""
