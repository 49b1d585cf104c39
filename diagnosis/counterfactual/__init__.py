"""A recorded mission under another law: abduct (faults and plant by the diagnosis), act (swap the law), predict.

law        the law that ran, as a controller; refused where the log does not tell it
abduct     the recorded world and its plant, from the aligned mission and the diagnosis
figures    tracking error, effort, recovery and wear of one law
bands      Monte Carlo over what is uncertain of plant and faults
tuning     gains of a law from healthy missions
run        the walk through these parts, with self-replay before anything else
document   what comes out, as types; words, page and columns around it
"""
