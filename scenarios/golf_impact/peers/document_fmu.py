"""The source document's scheme as an ordinary FMU: what a user of pythonfmu would write.

Explicit Euler: every quantity moves on with the rates it has at the start of a sub-step of dt.
Law 1, the document's: the spring force is k d and each body is dragged by b times its own velocity,
until d < 0. Law 2: the force is k d + b d', until it is negative. Nothing is interpolated: the
contact time is a whole number of sub-steps and the largest force is the largest sample.

The document doesn't give the end of its simulation. Its printed numbers follow if the spring goes
on pulling after d = 0 until the bodies are `end_gap` apart (`document.END_GAP`), which is 0
unless set: the scheme at its best.

This file is packed alone: it needs the standard library and pythonfmu only.
"""

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

#: Inputs, parameters and outputs with their start values; those of the outputs are 0.
_INPUTS = {"k": 1e6, "b": 9.0}  # contact stiffness, N/m; damping, N.s/m
_PARAMETERS = {
    "club_speed": 35.0,  # at first touch, m/s
    "ball_speed": 0.0,  # at first touch, m/s
    "m_club": 0.210,  # kg
    "m_ball": 0.04593,  # kg
    "dt": 0.5e-6,  # sub-step, s
    "end_gap": 0.0,  # law 1 ends when the bodies are farther apart than this, m
}
#: In contact, m: the state, with the velocities below.
_POSITIONS = ("club_position", "ball_position")
RESULTS = (
    "club_velocity",  # m/s
    "ball_velocity",  # m/s
    "max_force",  # largest sample so far, N
    "contact_time",  # so far, s
    "impulse",  # of the force so far, N.s
    # Set when contact ends:
    "contact_displacement",  # how far the ball moved in contact, m
    "smash_factor",  # ball velocity / club speed
    "coefficient_of_restitution",  # separation speed / approach speed
    "energy_efficiency",  # kinetic energy after / before
)


class DocumentImpact(Fmi2Slave):
    """A club hits a ball, stepped. SI units; the contact starts at time 0."""

    club_position: float
    ball_position: float

    def __init__(self, **kwargs) -> None:
        super().__init__(**kwargs)
        self.author = "golf-impact"
        self.description = "Golf club and ball by explicit Euler, as in the source document"

        starts = {**_INPUTS, **_PARAMETERS, **dict.fromkeys((*_POSITIONS, *RESULTS), 0.0)}
        starts |= {"law": 1, "in_contact": True}  # 1 absolute, 2 relative
        for name, start in starts.items():
            setattr(self, name, start)
        output = Fmi2Causality.output
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        for variable in (
            *(Real(name, causality=Fmi2Causality.input) for name in _INPUTS),
            *(Real(name, **fixed) for name in _PARAMETERS),
            Integer("law", **fixed),
            *(Real(name, causality=output) for name in (*_POSITIONS, *RESULTS)),
            Boolean("in_contact", causality=output, variability=Fmi2Variability.discrete),
        ):
            self.register_variable(variable)

    def exit_initialization_mode(self) -> None:
        self.club_velocity = self.club_speed
        self.ball_velocity = self.ball_speed
        if self.law == 2:
            self.max_force = self.b * (self.club_velocity - self.ball_velocity)

    def do_step(self, current_time: float, step_size: float) -> bool:
        dt = self.dt
        steps = round(step_size / dt)
        if steps < 1:
            return False
        k, m_club, m_ball = self.k, self.m_club, self.m_ball
        drag, damper, end_force = 0.0, self.b, 0.0
        if self.law == 1:
            drag, damper, end_force = self.b, 0.0, -k * self.end_gap
        x_club, x_ball = self.club_position, self.ball_position
        v_club, v_ball = self.club_velocity, self.ball_velocity
        force = k * (x_club - x_ball) + damper * (v_club - v_ball)
        for _ in range(steps if self.in_contact else 0):
            self.impulse += dt * force
            self.contact_time += dt
            x_club += dt * v_club
            x_ball += dt * v_ball
            v_club -= dt * (force + drag * v_club) / m_club
            v_ball += dt * (force - drag * v_ball) / m_ball
            force = k * (x_club - x_ball) + damper * (v_club - v_ball)
            if force > self.max_force:
                self.max_force = force
            elif force < end_force:
                self._separate(x_ball, v_club, v_ball)
                break
        self.club_position, self.ball_position = x_club, x_ball
        self.club_velocity, self.ball_velocity = v_club, v_ball
        return True

    def _separate(self, x_ball: float, v_club: float, v_ball: float) -> None:
        u_club, u_ball = self.club_speed, self.ball_speed
        self.in_contact = False
        self.contact_displacement = x_ball
        self.smash_factor = v_ball / u_club
        self.coefficient_of_restitution = (v_ball - v_club) / (u_club - u_ball)
        before = self.m_club * u_club**2 + self.m_ball * u_ball**2
        after = self.m_club * v_club**2 + self.m_ball * v_ball**2
        self.energy_efficiency = after / before
