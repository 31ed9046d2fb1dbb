"""The subject's surface: meshes and point clouds, their samples, and which camera sees which."""
