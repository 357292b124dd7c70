"""What is to be done: plug-ins found, requests read, cells planned; imports the words of the root and nothing else."""
