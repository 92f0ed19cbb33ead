"""The parameters of the document's Table 1, and those that its results come from."""

from golf_impact.scenario import Report, document, format_value, label, main

TITLE = "Table 1: parameters printed and parameters used"
CHAPTER = 13


def run(fmu):
    report = Report(TITLE, fmu)
    used = report.impact("used", **document.USED)
    printed = report.impact("Table 1", **document.TABLE_1)
    rows = [[f"{name} ({unit})", *values, ""] for name, unit, *values in document.PARAMETERS]
    outside = {"used": 0, "Table 1": 0}
    for metric, number in document.BASELINE.items():
        values = format_value(metric, printed[metric]), format_value(metric, used[metric])
        rows.append([label(metric), *values, number.text])
        allowed = 0.005 * number.value + number.half_digit
        for name, metrics in report.cases.items():
            outside[name] += abs(metrics[metric] - number.value) > allowed
    report.table(TITLE, ["", "with Table 1", "with those used", "printed"], rows)
    words = {name: f"{number} of {len(document.BASELINE)}" for name, number in outside.items()}
    claim = "the parameters used reproduce all printed numbers of the baseline within their error"
    report.check(claim, outside["used"] == 0, f"outside: {words['used']}", "documents")
    report.check("those of Table 1 don't", outside["Table 1"] > 0, f"outside: {words['Table 1']}")
    return report


if __name__ == "__main__":
    main(__file__)
