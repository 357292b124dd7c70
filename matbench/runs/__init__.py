"""What has been done: the run folder, who works on it, what is left; imports `files`, `measures` and `plans`."""
