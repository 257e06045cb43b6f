"""Between schemas in human units and the frozen SI records of routing and energy; a module for each noun."""
