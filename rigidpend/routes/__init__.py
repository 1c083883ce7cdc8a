"""Binary route codes: the sides on which an orbit leaves the periodic orbits that it passes.

`codes` is the way in; `problem` and `phases` hold what is asked, `start` where the orbits
begin, `certainty` what makes a symbol certain, `cycle` the graph of Fig. 2 and its symbols.
`mapped` finds routes by return maps, `neighbourhood` those of phases close together beside one
reference orbit, `change` the phase at which a symbol changes. `plane` finds those over a plane of
theta2_0 and J1_0, `bodies` those of orbits of several bodies and energies.
"""
