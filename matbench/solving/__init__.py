"""How cells are solved: processes, keepers, workers, a cluster; imports all but `results` and what lies above it."""
