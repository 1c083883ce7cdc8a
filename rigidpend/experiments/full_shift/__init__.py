"""Sets that passages stretch across each other: a proof that every code occurs."""
