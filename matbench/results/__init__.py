"""What follows from stored cells: scores, repeats, ablations, curves, archives; imports `runs` and what lies below."""
