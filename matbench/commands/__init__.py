"""Commands of their own modules, imported when they are typed."""
