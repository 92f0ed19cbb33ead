"""A calibration: the fit asked for beside others, and how both are shown."""

from collections.abc import Callable, Mapping
from typing import Any

from golf_build import VERSION
from golf_scenarios.calibration import laws
from golf_scenarios.calibration.contact_law import ContactLaw
from golf_scenarios.calibration.fitting import Fit, fit, missing
from golf_scenarios.calibration.targets import (
    DEFAULT_SIGMA,
    TARGETS,
    Conditions,
    Target,
    check_together,
    option,
)
from golf_scenarios.errors import UserError
from golf_scenarios.facts.quantities import QUANTITIES, Quantity
from golf_scenarios.fmu.file import current_fmu
from golf_scenarios.fmu.impact_fmu import ImpactFmu
from golf_scenarios.report.outcome import Table

#: A χ² that law and σ would exceed less often than this is a misfit.
_UNLIKELY = 0.01

_UNITS = {"k": "N/m", "b": "N.s/m", "exponent": ""}

#: Rows of the comparison, above the targets.
_COMPARED: dict[str, Callable[[Fit], str]] = {
    "k (N/m)": lambda found: f"{found.values['k']:.5g}",
    "b (N.s/m)": lambda found: f"{found.values['b']:.4g}",
    "n": lambda found: f"{found.values['exponent']:.4g}",
    "χ²": lambda found: f"{found.chi_squared:.3g}",
}


class Calibration:
    """The fit asked for, beside those of the laws that it is compared with.

    Args:
        fmu: in use.
        conditions: of the impact in which the targets were measured.
        targets: by name.
        law: the law asked for.

    Raises:
        UserError: the targets are impossible or too few.
    """

    def __init__(
        self, fmu: ImpactFmu, conditions: Conditions, targets: Mapping[str, Target], law: ContactLaw
    ) -> None:
        check(conditions, targets, law)
        self.conditions = conditions
        self.targets = targets
        self.fit = fit(fmu, conditions, targets, law)
        self.compared: list[tuple[ContactLaw, Fit | str]] = []
        for other in laws.compared(law.reference_compression):
            why = missing(other, targets)
            if other == law:
                self.compared.append((other, self.fit))
            elif why:
                self.compared.append((other, f"needs {len(other.free)} independent targets"))
            else:
                try:
                    self.compared.append((other, fit(fmu, conditions, targets, other)))
                except UserError as error:
                    self.compared.append((other, str(error)))

    @property
    def command(self) -> str:
        """The line that gives this very impact."""
        pairs = " ".join(f"--set {name}={value!r}" for name, value in self.fit.values.items())
        return f"golf-impact run {pairs}"

    @property
    def words(self) -> list[str]:
        """What there is to say about the fit."""
        found = self.fit
        words = [_sentence(note) for note in found.notes]
        words += [
            "These meet the targets just as well: " + _in_words(other) + "."
            for other in found.others
        ]
        default = [option(t.name) for t in self.targets.values() if not t.stated]
        if default:
            words.append(
                f"σ is taken as {DEFAULT_SIGMA * 100:g} % of {', '.join(default)} (none was given);"
                " standard errors and χ² follow from it."
            )
        if found.probability is None and found.chi_squared > 1e-6:
            words.append(
                "These targets can't be met together by this law; what comes nearest to them is "
                "shown, and standard errors are those of the σ alone."
            )
        elif found.probability is None:
            words.append(
                "As many targets as parameters: they are met exactly, whatever the law; χ² says "
                "nothing, and standard errors are those of the σ alone."
            )
        elif found.probability < _UNLIKELY:
            words.append(
                f"This law doesn't fit: χ² = {found.chi_squared:.3g} with "
                f"{found.degrees_of_freedom} degrees of freedom (chance "
                f"{found.probability:.1g}). The law is wrong, or targets contradict each other."
            )
        better = self._better()
        if better:
            words.append(better)
        return words

    def _better(self) -> str | None:
        others = [
            other
            for _, other in self.compared
            if isinstance(other, Fit)
            and other is not self.fit
            and (other.probability or 0.0) > 0.05
        ]
        if (self.fit.probability or 1.0) >= _UNLIKELY or not others:
            return None
        best = min(others, key=lambda other: other.chi_squared)
        n = "free" if best.law.exponent is None else f"{best.law.exponent:g}"
        how = "--law 1" if best.law.law == 1 else f"--exponent {n}"
        return f"{best.law.title} fits (χ² = {best.chi_squared:.3g}): try {how}."

    def tables(self) -> list[Table]:
        """Parameters, targets, and the comparison of laws."""
        found = self.fit
        parameters = [
            [
                f"{name} ({_UNITS[name]})" if _UNITS[name] else name,
                f"{found.values[name]:.6g}",
                _error(found.standard_errors[name]),
            ]
            for name in found.law.free
        ]
        rows = [
            [
                label(name),
                _shown(name, target.value),
                _shown(name, target.sigma, 2),
                _shown(name, found.predicted[name]),
                f"{found.residuals[name]:+.2f}",
            ]
            for name, target in self.targets.items()
        ]
        rows += [
            [label(name), "", "", _shown(name, found.predicted[name]), "predicted"]
            for name in TARGETS
            if name not in self.targets
        ]
        measured = self.conditions
        return [
            Table(
                f"{found.law.title} (law {found.law.law}), {found.method}; club "
                f"{measured.club_speed:g} m/s and {measured.m_club:g} kg, ball "
                f"{measured.m_ball:g} kg",
                ["", "value", "standard error"],
                parameters,
            ),
            Table(
                f"Targets: χ² = {found.chi_squared:.3g}, degrees of freedom "
                f"{found.degrees_of_freedom}",
                ["", "target", "σ", "model", "residual (σ)"],
                rows,
            ),
            self._comparison(),
        ]

    def _comparison(self) -> Table:
        fits = self.compared
        rows = []
        for row, shown in _COMPARED.items():
            cells = [shown(found) if isinstance(found, Fit) else "" for _, found in fits]
            rows.append([row, *cells])
        rows += [
            [label(name)]
            + [
                _shown(name, found.predicted[name], 4) if isinstance(found, Fit) else ""
                for _, found in fits
            ]
            for name in TARGETS
        ]
        for n, (_, found) in enumerate(fits, 1):
            if isinstance(found, str):
                rows[0][n] = found
        return Table("The laws compared", ["", *[law.title for law, _ in fits]], rows)

    def as_json(self) -> dict[str, Any]:
        """All of it, for calibrate.json (SI units)."""
        found = self.fit
        return {
            "version": VERSION,
            "command": self.command,
            "law": found.law.law,
            "title": found.law.title,
            "method": found.method,
            "parameters": _parameters(found),
            "fixed": {n: v for n, v in found.values.items() if n not in found.law.free},
            "targets": [
                {
                    "name": name,
                    "target": target.value,
                    "sigma": target.sigma,
                    "sigma_given": target.stated,
                    "model": found.predicted[name],
                    "residual": found.residuals[name],
                }
                for name, target in self.targets.items()
            ],
            "predicted": found.predicted,
            "chi_squared": found.chi_squared,
            "degrees_of_freedom": found.degrees_of_freedom,
            "probability": found.probability,
            "other_solutions": found.others,
            "notes": self.words,
            "comparison": [_compared(law, other) for law, other in self.compared],
        }

    def drawn(self) -> bytes:
        """The figure as PNG."""
        from golf_scenarios.calibration.drawing import draw
        from golf_scenarios.report import figures

        return figures.png(draw(self.fit, self.compared, self.targets))


def check(conditions: Conditions, targets: Mapping[str, Target], law: ContactLaw) -> None:
    """Refuse what can't be answered, with the reason.

    Raises:
        UserError: the impact or the targets are impossible, or there are too few.
    """
    if not targets:
        raise UserError(
            "calibrate needs at least two measured targets, e.g. golf-impact calibrate --cor 0.743 "
            f"--contact-time 600e-6; there are {', '.join(option(name) for name in TARGETS)}"
        )
    check_together(targets, conditions, law.law)
    why = missing(law, targets)
    if why:
        raise UserError(f"too few targets for {law.title}: {why}")


def calibrated(
    conditions: Conditions,
    targets: Mapping[str, Target],
    law: ContactLaw,
    prepare: Callable[[], object] = lambda: None,
) -> Calibration:
    """The calibration with the FMU of the present sources.

    Args:
        conditions: of the impact in which the targets were measured.
        targets: by name.
        law: with its free parameters.
        prepare: called before the search begins.

    Raises:
        UserError: the targets are impossible or too few, or SciPy is missing.
    """
    check(conditions, targets, law)
    try:
        import scipy  # noqa: F401
    except ImportError:
        raise UserError(
            'calibrate needs SciPy: install it with `pip install "golf-impact[calibrate]"`'
        ) from None
    prepare()
    with ImpactFmu(current_fmu()[0]) as fmu:
        return Calibration(fmu, conditions, targets, law)


def _quantity(name: str) -> Quantity:
    """A target as tables show it."""
    output, text = TARGETS[name]
    return QUANTITIES[output]._replace(name=text, symbol="")


def label(name: str) -> str:
    """A target with the unit it is shown in."""
    return _quantity(name).label


def _shown(name: str, value: float, digits: int = 5) -> str:
    return f"{value * _quantity(name).factor:.{digits}g}"


def _error(error: float | None) -> str:
    return "not defined" if error is None else f"{error:.2g}"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _in_words(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {values[name]:.6g}" for name in ("k", "b", "exponent"))


def _parameters(found: Fit) -> dict[str, dict[str, float | None]]:
    return {
        name: {"value": found.values[name], "standard_error": found.standard_errors[name]}
        for name in found.law.free
    }


def _compared(law: ContactLaw, found: Fit | str) -> dict[str, Any]:
    row: dict[str, Any] = {"title": law.title, "law": law.law, "exponent": law.exponent}
    if isinstance(found, str):
        return {**row, "not_fitted": found}
    return {
        **row,
        "exponent": found.values["exponent"],
        "parameters": _parameters(found),
        "predicted": found.predicted,
        "residuals": found.residuals,
        "chi_squared": found.chi_squared,
        "degrees_of_freedom": found.degrees_of_freedom,
        "probability": found.probability,
    }
