"""Say whether two reports have equal traces, bit for bit: python .ci/same_traces.py REPORT OTHER."""

import importlib.metadata
import sys
from pathlib import Path

import pandas as pd

reports = [Path(folder) / "trace" for folder in sys.argv[1:]]
tables = [sorted(str(path.relative_to(trace)) for path in trace.rglob("*.parquet")) for trace in reports]
if tables[0] != tables[1] or not tables[0]:
    sys.exit(f"error: {reports[1]}: its tables are {tables[1]}, not {tables[0]}")
differences = [
    table for table in tables[0] if not pd.read_parquet(reports[0] / table).equals(pd.read_parquet(reports[1] / table))
]
drake = importlib.metadata.version("drake")
print(f"Drake {drake}: {len(tables[0])} tables, {len(differences)} differ {differences or ''}")
