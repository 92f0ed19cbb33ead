"""The document's impact in sub-steps as an ordinary FMU: what a user of pythonfmu would write.

Each communication step is a whole impact, from first touch to the end of contact, so that no FMI
call is needed in between. Explicit Euler is the source document's scheme: contact ends with the
first sample whose force is negative.

Law 1, the document's: the force is k d, and each body is dragged by b times its own velocity. Law
2: the force is k d + b d'. `stepped_impact.c` is the same in C, with these value references.

This file is packed alone: it needs the standard library and pythonfmu only.
"""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

CLUB_SPEED, M_CLUB, M_BALL = 35.0, 0.210, 0.04593  # m/s, at first touch of a ball at rest; kg
B = 9.0  # damping, N.s/m


class SteppedImpact(Fmi2Slave):
    """A club hits a ball; SI units."""

    def __init__(self, **kwargs) -> None:
        super().__init__(**kwargs)
        self.k = 1e6  # contact stiffness, N/m
        self.dt = 0.5e-6  # sub-step, s
        self.law = 1
        self.smash_factor = self.coefficient_of_restitution = self.energy_efficiency = 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Real("k", causality=Fmi2Causality.input))
        self.register_variable(Real("dt", **fixed))
        self.register_variable(Integer("law", **fixed))
        for name in ("smash_factor", "coefficient_of_restitution", "energy_efficiency"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:
        dt, k, m_club, m_ball = self.dt, self.k, M_CLUB, M_BALL
        damper, drag = (0.0, B) if self.law == 1 else (B, 0.0)
        d, v_club, v_ball = 0.0, CLUB_SPEED, 0.0
        force = damper * v_club
        for _ in range(round(step_size / dt)):
            d += dt * (v_club - v_ball)
            v_club -= dt * (force + drag * v_club) / m_club
            v_ball += dt * (force - drag * v_ball) / m_ball
            force = k * d + damper * (v_club - v_ball)
            if force < 0.0:
                break
        energy = m_club * v_club**2 + m_ball * v_ball**2
        self.smash_factor = v_ball / CLUB_SPEED
        self.coefficient_of_restitution = (v_ball - v_club) / CLUB_SPEED
        self.energy_efficiency = energy / (m_club * CLUB_SPEED**2)
        return True
