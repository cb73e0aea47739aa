"""Any discrete-time map: the map, cells, the transition graph, and what a graph and orbits answer."""
