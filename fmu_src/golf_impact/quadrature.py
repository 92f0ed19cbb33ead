"""Gauss–Legendre's rule with 5 points, as nodes on (-1, 1) and weights."""

#: Exact to a double for what changes by little over half a time scale.
GAUSS_5 = (
    (0.0, 0.5688888888888889),
    (0.5384693101056831, 0.47862867049936647),
    (-0.5384693101056831, 0.47862867049936647),
    (0.906179845938664, 0.23692688505618908),
    (-0.906179845938664, 0.23692688505618908),
)
