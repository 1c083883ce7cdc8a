"""Binary route codes: the sides on which an orbit leaves the periodic orbits that it passes.

`codes` is the way in, `cells` that for orbits with parameters of their own. `problem` and `phases`
hold what is asked, `start` where the orbits begin, `certainty` what makes a symbol certain, `cycle`
the graph of Fig. 2 and its symbols. `run` integrates the orbits of a call, `mapped` follows them by
return maps, and `choice` has the one or the other decide, by the `costs` of both; by `handover` an
integration begins what a map goes on with. `neighbourhood` finds routes of phases close together
beside one reference orbit, and the phase at which a symbol changes; `herpolhode` samples one orbit.
"""
