"""Objects by name, for tasks that are about certain ones."""

PAPER_OBJECTS = ("box", "espressomachine", "ketchup", "laptop", "microwave", "mixer", "notebook", "waffleiron")
"""The paper's eight objects, which `artigrasp import-arctic` makes of a user's copy of ARCTIC."""
