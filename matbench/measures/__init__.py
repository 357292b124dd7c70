"""Numbers about maps and volumes: metrics, prediction, statistics; imports the words of the root and nothing else."""
