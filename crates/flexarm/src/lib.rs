//! From a robot file and a trajectory to a result: the facade of the flexarm workspace
