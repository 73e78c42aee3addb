"""Initial value problems: Legendre transforms, discrete flows, simulation, replay of torques."""
