"""Results of scenarios as files: JSON, pictures, report.html."""
