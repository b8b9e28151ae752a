"""Reports: report.json is the truth; HTML, JUnit and the figures render it."""
