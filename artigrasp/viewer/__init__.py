"""The viewer: motions, references and running tasks in a browser."""
