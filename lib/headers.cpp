// Nothing: the precompiled headers of the rooms belong to this file's targets.
