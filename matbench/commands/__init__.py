"""Commands in modules of their own, imported when they are typed."""
