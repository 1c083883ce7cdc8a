"""Phase portraits of the free body, on the sphere and in the plane: Fig. 1."""
