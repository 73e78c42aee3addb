"""Initial value problems: Legendre transforms, discrete flows, simulation, torque replay."""
