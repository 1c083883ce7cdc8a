"""Certified route codes: a rigorous a-posteriori proof of every symbol, for the exact problem.

`docs/certified.md` states the theorem and proves it; it names the function that checks each
hypothesis. `checker` is the proof, with `growth` (logarithmic norm), `signs`, `models`
(polynomials with integer coefficients) and `balls` (enclosures of the problem's numbers) under
it. `approximation` finds the polynomials and need not be trusted; `proofs` brings both
together, `codes` makes route codes of them, `certificates`, `steps` and `storage` certificates.
"""
