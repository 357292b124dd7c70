"""Recordings for the rerun viewer. Imports only the root modules, `measures` and `plans`."""
