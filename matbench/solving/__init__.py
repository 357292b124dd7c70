"""How cells are solved: in processes of their own, here or on a cluster. Imports no `results` nor what is above it."""
