//! Solid elements: shape functions, quadrature, stiffness and mass of one element.
