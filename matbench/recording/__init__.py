"""What the rerun viewer shows; imports the root's words, `measures` and `plans`."""
