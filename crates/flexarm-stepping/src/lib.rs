//! Time steppers for flexible arms: generalised-alpha, SPOOK, RK4, and statics
