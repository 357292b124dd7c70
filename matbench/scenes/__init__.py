"""Where scenes come from: found, fetched, checked; imports the root's words, `files`, `measures` and `plans`."""
