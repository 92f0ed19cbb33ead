"""Law 1: a spring between the bodies and a drag b·v on each of them (the source document's law).

m_C v_C' = -k d - b v_C,  m_B v_B' = k d - b v_B,  d' = v_C - v_B, in contact until d returns to 0.
The drag acts on absolute velocities, so momentum is lost to the surroundings, the result depends
on the frame of reference, and heavy damping can keep the bodies together for ever.
"""

from .law import LinearLaw


class AbsoluteLaw(LinearLaw):
    """Law 1; see `Law`."""

    name = "absolute"
    description = "A spring between the bodies and a drag b*v on each: the source document's"

    def drag(self, b: float) -> float:
        return b
