"""One file a program, or a form that several programs share: keys, values, units."""
