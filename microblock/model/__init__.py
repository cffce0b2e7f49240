"""What is given and what comes out, numpy only: material, obstacle, law, problem, zones, state, methods."""
