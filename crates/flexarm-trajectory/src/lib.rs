//! Joint trajectories as piecewise polynomials: files, splines, point-to-point profiles, limits
