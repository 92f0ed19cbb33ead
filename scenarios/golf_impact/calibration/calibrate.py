"""A calibration: the fit asked for beside others, and how both are shown."""

from collections.abc import Mapping
from typing import Any

from golf_build import VERSION
from golf_impact.calibration import targets as measured
from golf_impact.calibration.contact_law import ContactLaw
from golf_impact.calibration.fitting import Fit, fit, missing
from golf_impact.calibration.targets import TARGETS, Conditions, Target, option
from golf_impact.errors import UserError, missing_package
from golf_impact.facts.quantities import QUANTITIES
from golf_impact.fmu.file import current_fmu
from golf_impact.fmu.impact_fmu import ImpactFmu
from golf_impact.report.outcome import Table

#: A χ² that law and σ would exceed less often than this is a misfit.
_UNLIKELY = 0.01

#: Parameters with their units, as tables show them.
_PARAMETERS = {"k": "k (N/m)", "b": "b (N·s/m)", "exponent": "exponent"}

#: Targets as tables show them.
_SHOWN = {
    name: QUANTITIES[output]._replace(name=text, symbol="")
    for name, (output, text, _) in TARGETS.items()
}

#: Every calibration is compared with Kelvin–Voigt, absolute, Tsuji and free n.
_COMPARED = ((2, 1.0), (1, 1.0), (2, 1.5), (2, None))


class Calibration:
    """The fit asked for, beside those of the laws that it is compared with.

    Raises:
        UserError: no contact that ends comes near the targets.
    """

    def __init__(
        self, fmu: ImpactFmu, conditions: Conditions, targets: Mapping[str, Target], law: ContactLaw
    ) -> None:
        self.conditions = conditions
        self.targets = targets
        self.fit = fit(fmu, conditions, targets, law)
        self.compared: list[tuple[ContactLaw, Fit | str]] = []
        for number, exponent in _COMPARED:
            other = ContactLaw(number, exponent, law.reference_compression)
            result: Fit | str = self.fit
            if missing(other, targets):
                result = f"needs {len(other.free)} independent targets"
            elif other != law:
                try:
                    result = fit(fmu, conditions, targets, other)
                except UserError as error:
                    result = str(error)
            self.compared.append((other, result))

    @property
    def command(self) -> str:
        """The line that gives this very impact."""
        pairs = " ".join(f"--set {name}={value!r}" for name, value in self.fit.values.items())
        return f"golf-impact run {pairs}"

    @property
    def words(self) -> list[str]:
        best, chance = self.fit, self.fit.probability
        words = [f"{note[0].upper()}{note[1:]}." for note in best.notes]
        for other in best.others:
            values = ", ".join(f"{name} = {other[name]:.6g}" for name in _PARAMETERS)
            words.append(f"These meet the targets just as well: {values}.")
        default = [option(t.name) for t in self.targets.values() if not t.stated]
        if default:
            words.append(
                f"σ is taken as {measured.DEFAULT_SIGMA * 100:g} % of {', '.join(default)} (none "
                "was given); standard errors and χ² follow from it."
            )
        if chance is None and best.chi_squared > 1e-6:
            words.append(
                "These targets can't be met together by this law; what comes nearest to them is "
                "shown, and standard errors are those of the σ alone."
            )
        elif chance is None:
            words.append(
                "As many targets as parameters: they are met exactly, whatever the law; χ² says "
                "nothing, and standard errors are those of the σ alone."
            )
        elif chance < _UNLIKELY:
            words.append(
                f"This law doesn't fit: χ² = {best.chi_squared:.3g} with "
                f"{best.degrees_of_freedom} degrees of freedom (chance {chance:.1g}). The law is "
                "wrong, or targets contradict each other."
            )
            words += self._better()
        return words

    def _better(self) -> list[str]:
        fits = [other for _, other in self.compared if isinstance(other, Fit)]
        likely = [other for other in fits if (other.probability or 0.0) > 0.05]
        if not likely:
            return []
        best = min(likely, key=lambda other: other.chi_squared)
        n = "free" if best.law.exponent is None else f"{best.law.exponent:g}"
        how = "--law 1" if best.law.law == 1 else f"--exponent {n}"
        return [f"{best.law.title} fits (χ² = {best.chi_squared:.3g}): try {how}."]

    def tables(self) -> list[Table]:
        """Parameters, targets, and the comparison of laws."""
        best, impact = self.fit, self.conditions
        parameters = []
        for name, error in best.standard_errors.items():
            words = "not defined" if error is None else f"{error:.2g}"
            parameters.append([_PARAMETERS[name], f"{best.values[name]:.6g}", words])
        rows = []
        for name, target in self.targets.items():
            value, sigma = _shown(name, target.value), _shown(name, target.sigma, 2)
            model, off = _shown(name, best.predicted[name]), f"{best.residuals[name]:+.2f}"
            rows.append([_SHOWN[name].label, value, sigma, model, off])
        for name in TARGETS:
            if name not in self.targets:
                model = _shown(name, best.predicted[name])
                rows.append([_SHOWN[name].label, "", "", model, "predicted"])
        return [
            Table(
                f"{best.law.title} (law {best.law.law}), {best.method}; club {impact.club_speed:g} "
                f"m/s and {impact.m_club:g} kg, ball {impact.m_ball:g} kg",
                ["", "value", "standard error"],
                parameters,
            ),
            Table(
                f"Targets: χ² = {best.chi_squared:.3g}, degrees of freedom "
                f"{best.degrees_of_freedom}",
                ["", "target", "σ", "model", "residual (σ)"],
                rows,
            ),
            self._comparison(),
        ]

    def _comparison(self) -> Table:
        labels = ["k (N/m)", "b (N·s/m)", "n", "χ²", *(one.label for one in _SHOWN.values())]
        columns = []
        for _, fitted in self.compared:
            if isinstance(fitted, str):
                columns.append([fitted, *[""] * (len(labels) - 1)])
            else:
                k, b, n = (fitted.values[name] for name in _PARAMETERS)
                found = [f"{k:.5g}", f"{b:.4g}", f"{n:.4g}", f"{fitted.chi_squared:.3g}"]
                columns.append(
                    found + [_shown(name, fitted.predicted[name], 4) for name in TARGETS]
                )
        rows = [list(row) for row in zip(labels, *columns, strict=True)]
        return Table("The laws compared", ["", *[law.title for law, _ in self.compared]], rows)

    def as_json(self) -> dict[str, Any]:
        """All of it, for calibrate.json (SI units)."""
        best = self.fit
        return {
            "version": VERSION,
            "command": self.command,
            "law": best.law.law,
            "title": best.law.title,
            "method": best.method,
            **_numbers(best),
            "fixed": {n: v for n, v in best.values.items() if n not in best.law.free},
            "targets": [
                {
                    "name": name,
                    "target": target.value,
                    "sigma": target.sigma,
                    "sigma_given": target.stated,
                    "model": best.predicted[name],
                    "residual": best.residuals[name],
                }
                for name, target in self.targets.items()
            ],
            "other_solutions": best.others,
            "notes": self.words,
            "comparison": [
                {"title": law.title, "law": law.law, "exponent": law.exponent}
                | (
                    {"not_fitted": fitted}
                    if isinstance(fitted, str)
                    else {"exponent": fitted.values["exponent"], "residuals": fitted.residuals}
                    | _numbers(fitted)
                )
                for law, fitted in self.compared
            ],
        }

    def drawn(self) -> bytes:
        from golf_impact.calibration.drawing import draw
        from golf_impact.report import figures

        return figures.to_png(draw(self.fit, self.compared, self.targets))


def check(conditions: Conditions, targets: Mapping[str, Target], law: ContactLaw) -> None:
    """Refuse what can't be answered, with the reason.

    Raises:
        UserError: the impact or the targets are impossible, or there are too few.
    """
    if not targets:
        raise UserError(
            "calibrate needs at least two measured targets, e.g. golf-impact calibrate --cor 0.743 "
            f"--contact-time 600e-6; there are {', '.join(map(option, TARGETS))}"
        )
    measured.check_together(targets, conditions, law.law)
    if why := missing(law, targets):
        raise UserError(f"too few targets for {law.title}: {why}")


def calibrated(
    conditions: Conditions, targets: Mapping[str, Target], law: ContactLaw
) -> Calibration:
    """The calibration with the FMU of the present sources.

    Raises:
        UserError: the targets are impossible or too few, or SciPy is missing.
    """
    check(conditions, targets, law)
    try:
        import scipy  # noqa: F401
    except ImportError:
        raise missing_package("calibrate", "SciPy", "calibrate") from None
    with ImpactFmu(current_fmu()[0]) as fmu:
        return Calibration(fmu, conditions, targets, law)


def _shown(name: str, value: float, digits: int = 5) -> str:
    return f"{value * _SHOWN[name].factor:.{digits}g}"


def _numbers(fitted: Fit) -> dict[str, Any]:
    """What calibrate.json says of every fit."""
    return {
        "parameters": {
            name: {"value": fitted.values[name], "standard_error": error}
            for name, error in fitted.standard_errors.items()
        },
        "predicted": fitted.predicted,
        "chi_squared": fitted.chi_squared,
        "degrees_of_freedom": fitted.degrees_of_freedom,
        "probability": fitted.probability,
    }
