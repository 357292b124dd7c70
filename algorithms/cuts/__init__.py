"""Labels by minimal cuts of graphs: maximal flows, and expansion moves for one view and for all views at once."""
