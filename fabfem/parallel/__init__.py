"""A run that many processes share, over MPI with PETSc: `mpiexec -n 4 fabfem solve case.toml`.

The mesh is read by the first rank and divided by elements; a patch of elements with one volume strain stays together.
A rank keeps its elements with their nodes, its points with their states, and the rows of the nodes that it owns; of
nodes that several ranks have, the lowest such rank is the owner. `fabfem.fem.ranks` says what is summed where. Ranks
that a small mesh has nothing for leave before PETSc is told who takes part (`team`).
"""
