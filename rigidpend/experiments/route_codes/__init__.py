"""Binary route codes over initial phases: Fig. 4."""
