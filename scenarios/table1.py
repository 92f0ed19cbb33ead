"""The document's Table 1 as printed, beside the parameters that its numbers really come from."""

from golf_scenarios.scenario import Report, document, label, main, shown

TITLE = "Table 1: the parameters printed, and those used"
CHAPTER = 13


def run(fmu):
    """Two impacts, two communication steps."""
    report = Report(TITLE, fmu)
    used = report.impact("used", **document.USED)
    printed = report.impact("Table 1", **document.TABLE_1)
    rows = [
        [f"{name} ({unit})", f"{document.TABLE_1[name]:g}", f"{document.USED[name]:g}", ""]
        for name, unit in (("m_club", "kg"), ("m_ball", "kg"), ("ball_diameter", "m"))
    ]
    rows += [
        [label(metric), shown(metric, printed[metric]), shown(metric, used[metric]), number.text]
        for metric, number in document.BASELINE.items()
    ]
    report.table(TITLE, ["", "with Table 1", "with those used", "document prints"], rows)

    def misses(metrics):
        return sum(
            abs(metrics[metric] - number.value) > 0.005 * number.value + number.half_digit
            for metric, number in document.BASELINE.items()
        )

    number, off = len(document.BASELINE), misses(printed)
    report.check(
        "the parameters used explain every printed number of the baseline",
        misses(used) == 0,
        f"{misses(used)} of {number} are off",
    )
    report.check("those of Table 1 don't", off > 0, f"{off} of {number} are off")
    report.say(
        f"With Table 1's masses and diameter {off} of {number} printed numbers "
        "lie outside the document's numerical error (its initial momentum would be 7.00, not 7.35 "
        "N·s). The numbers come from 0.210 kg, 0.04593 kg and 0.04267 m."
    )
    return report


if __name__ == "__main__":
    main(__file__)
