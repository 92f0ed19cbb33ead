"""The impact in sub-steps as an ordinary FMU: what a user of pythonfmu would write.

Each communication step is a whole impact, from first touch to the end of contact, so that no FMI
call is needed in between. Explicit Euler (order 1) is the source document's scheme: contact ends
with the first sample whose force is negative. The last sub-step of the classical Runge-Kutta method
(order 4) ends where the force is 0.

Law 1, the document's: the force is k d, and each body is dragged by b times its own velocity. Law
2: the force is k d + b d'. `stepped_impact.c` is the same in C, with these value references.

This file is packed alone: it needs the standard library and pythonfmu only.
"""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

INPUTS = {"k": 1e6, "b": 9.0}  # contact stiffness, N/m; damping, N.s/m
PARAMETERS = {
    "club_speed": 35.0,  # at first touch, m/s
    "ball_speed": 0.0,  # at first touch, m/s
    "m_club": 0.210,  # kg
    "m_ball": 0.04593,  # kg
    "dt": 0.5e-6,  # sub-step, s
}
CHOICES = {"law": 1, "order": 1}
OUTPUTS = ("smash_factor", "coefficient_of_restitution", "energy_efficiency")


class SteppedImpact(Fmi2Slave):
    """A club hits a ball; SI units."""

    def __init__(self, **kwargs) -> None:
        super().__init__(**kwargs)
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        for kind, starts, options in (
            (Real, INPUTS, {"causality": Fmi2Causality.input}),
            (Real, PARAMETERS, fixed),
            (Integer, CHOICES, fixed),
            (Real, dict.fromkeys(OUTPUTS, 0.0), {"causality": Fmi2Causality.output}),
        ):
            for name, start in starts.items():
                setattr(self, name, start)
                self.register_variable(kind(name, **options))

    def do_step(self, current_time: float, step_size: float) -> bool:
        method = self._euler if self.order == 1 else self._runge_kutta
        damper, drag = (0.0, self.b) if self.law == 1 else (self.b, 0.0)
        v_club, v_ball = method(round(step_size / self.dt), damper, drag)
        before = self.m_club * self.club_speed**2 + self.m_ball * self.ball_speed**2
        after = self.m_club * v_club**2 + self.m_ball * v_ball**2
        self.smash_factor = v_ball / self.club_speed
        self.coefficient_of_restitution = (v_ball - v_club) / (self.club_speed - self.ball_speed)
        self.energy_efficiency = after / before
        return True

    def _euler(self, steps: int, damper: float, drag: float) -> tuple[float, float]:
        """Velocities after the contact, m/s."""
        dt, k, m_club, m_ball = self.dt, self.k, self.m_club, self.m_ball
        d, v_club, v_ball = 0.0, self.club_speed, self.ball_speed
        force = damper * (v_club - v_ball)
        for _ in range(steps):
            d += dt * (v_club - v_ball)
            v_club -= dt * (force + drag * v_club) / m_club
            v_ball += dt * (force - drag * v_ball) / m_ball
            force = k * d + damper * (v_club - v_ball)
            if force < 0.0:
                break
        return v_club, v_ball

    def _runge_kutta(self, steps: int, damper: float, drag: float) -> tuple[float, float]:
        """Velocities after the contact, m/s."""
        k, m_club, m_ball = self.k, self.m_club, self.m_ball
        state = [0.0, self.club_speed, self.ball_speed]

        def rates(d, v_club, v_ball):
            force = k * d + damper * (v_club - v_ball)
            club, ball = force + drag * v_club, force - drag * v_ball
            return v_club - v_ball, -club / m_club, ball / m_ball, force

        def step(state, h):
            stage = state
            for share in (4, 3, 2, 1):  # the equations are linear: all stages by Horner's scheme
                stage = [y + h / share * rate for y, rate in zip(state, rates(*stage))]
            return stage

        for _ in range(steps):
            before, state = state, step(state, self.dt)
            if rates(*state)[-1] < 0.0:
                h = self.dt
                for _ in range(5):  # Newton's method; the force is linear in the state
                    *slopes, force = rates(*state)
                    h -= force / rates(*slopes)[-1]
                    state = step(before, h)
                break
        return state[1], state[2]
