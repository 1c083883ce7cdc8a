"""Asymptotic surfaces (stable, unstable manifolds) of the periodic orbits, and their splitting.

Modules
-------
melnikov        Melnikov's integral on the four separatrices, its zeros; orbits near them
curves          the surfaces S1- and S2+ as curves (Fig. 3)
surface_orbits  orbits of S1- up to the section
splitting       the distance of the surfaces as a Fourier series, against Melnikov's formula
heteroclinic    the orbits at g = +-pi/2, and the growth of theta3 along them

At J3 = 0 and one energy the section J1 = J2/2 has two coordinates: the phase g = theta1/2 + theta2
and the offset theta1 - alpha0 - beta0 from separatrix 2. S1- meets it in a closed curve,
offset = F(g).

All else follows from this curve by three exact symmetries:

- M3, gamma3 and t change sign (see `curves.S2_plus`): on the section g becomes pi - g and the
  offset stays. So S2+ meets the section in offset = F(pi - g), and the two surfaces cross at
  g = +-pi/2 whatever mu is.
- mu and gamma change sign: g moves by pi. So F(g) at -mu is F(g + pi) at mu.
- r2, M1, M3 and gamma2 change sign, or M1, M2 and gamma3 do: separatrix 1, or 4, takes the place
  of separatrix 2; see `surface_orbits.surface`.
"""
