"""The document's Table 1 as printed, beside the parameters that its numbers really come from."""

from golf_impact.scenario import Report, document, label, main, shown

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
    off = {"used": 0, "Table 1": 0}
    for metric, number in document.BASELINE.items():
        values = shown(metric, printed[metric]), shown(metric, used[metric])
        rows.append([label(metric), *values, number.text])
        allowed = 0.005 * number.value + number.half_digit
        for name, metrics in report.cases.items():
            off[name] += abs(metrics[metric] - number.value) > allowed
    report.table(TITLE, ["", "with Table 1", "with those used", "document prints"], rows)
    words = {name: f"{misses} of {len(document.BASELINE)}" for name, misses in off.items()}
    claim = "the parameters used explain every printed number of the baseline"
    report.check(claim, off["used"] == 0, f"{words['used']} are off")
    report.check("those of Table 1 don't", off["Table 1"] > 0, f"{words['Table 1']} are off")
    report.say(
        f"With Table 1's masses and diameter {words['Table 1']} printed numbers "
        "lie outside the document's numerical error (its initial momentum would be 7.00, not 7.35 "
        "N·s). The numbers come from 0.210 kg, 0.04593 kg and 0.04267 m."
    )
    return report


if __name__ == "__main__":
    main(__file__)
