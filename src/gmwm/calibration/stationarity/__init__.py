"""Whether a record has what stationary noise has not: departures, and slow noise that changes."""
