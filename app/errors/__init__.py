"""Problems as clients see them: what is raised, how it is described, the table of all."""
