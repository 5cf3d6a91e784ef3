//! URDF and its meshes to a flexarm mechanism
