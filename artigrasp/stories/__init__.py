"""Stories: hands manipulate several objects of one scene, step after step (paper supplement, Long Sequence)."""
