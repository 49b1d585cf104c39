"""A recorded mission under another law: what was given to the machine stays, the law that answers is another.

Two worlds run side by side. In the recorded one everything is known but the load d on each wheel; the other has the same
commands, ground, loads, noise and faults, and another law. What both share cancels in their difference, so that the
difference, and nothing else, is simulated:

    τ Δv' = −Δv + [p(u_v*) − p(u_v)] − [f(s*) − f(s)]         p: valve map and pump share, f: tyre, s: slip against the body
    u_v* = u_v + δ_a (u* − u)                                 L8 (7): the valve's fault lets δ_a = 1 − ε_a through
    y*   = y + δ_s Δv                                         L4: the sensor's fault lets δ_s = 1 − ε_s through

With the recorded law Δv stays 0, whatever the loads were; how far it does not is the test of the law (self-replay).
"""
