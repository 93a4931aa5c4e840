// Nothing: precompiled headers need a target, and a target a file.
