"""The simulation study of Stebler et al. (2012), and a harder case, over the public API."""
