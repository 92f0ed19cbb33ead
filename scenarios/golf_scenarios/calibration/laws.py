"""The laws that every calibration is compared with, and the one that the user asks for."""

from golf_scenarios.calibration.contact_law import LARGEST_EXPONENT, LEAST_EXPONENT, ContactLaw
from golf_scenarios.errors import UserError


def asked_for(law: int, exponent: str, reference_compression: float) -> ContactLaw:
    """The law of the command line; the exponent is a number as text, or "free".

    Raises:
        UserError: there is no such law.
    """
    if law not in (1, 2):
        raise UserError(f"--law {law} is refused: it must be 1 (absolute) or 2 (relative)")
    if not 0.0 < reference_compression < float("inf"):
        raise UserError(
            f"--reference-compression {reference_compression!r} is refused: it must be a finite "
            "number of metres above 0"
        )
    n = None
    if exponent.strip().lower() != "free":
        try:
            n = float(exponent)
        except ValueError:
            raise UserError(
                f"--exponent {exponent} is refused: it must be a number or the word free"
            ) from None
        if not LEAST_EXPONENT <= n <= LARGEST_EXPONENT:
            raise UserError(
                f"--exponent {exponent} is refused: it must be between {LEAST_EXPONENT:g} and "
                f"{LARGEST_EXPONENT:g}, or free"
            )
    if law == 1 and n != 1.0:
        raise UserError(
            f"--exponent {exponent} is refused with --law 1 (absolute), which is linear: leave it "
            "out, or take --law 2"
        )
    return ContactLaw(law, n, reference_compression)


def compared(reference_compression: float) -> tuple[ContactLaw, ...]:
    """Kelvin–Voigt, absolute, Tsuji and free n."""
    laws = ((2, 1.0), (1, 1.0), (2, 1.5), (2, None))
    return tuple(ContactLaw(law, n, reference_compression) for law, n in laws)
