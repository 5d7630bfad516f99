"""Tools of every room: checks of what was given, files, units, types, words."""
