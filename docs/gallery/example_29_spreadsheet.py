"""
Into a spreadsheet
==================

Every result with a table writes a workbook, a sheet for each table.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

import hdopt

file = Path(tempfile.mkdtemp()) / "stack.xlsx"
hdopt.write_tables(hdopt.stack("csf-25-80", 2**12), file)
sheets = pd.read_excel(file, sheet_name=None)
print({name: table.shape for name, table in sheets.items()})
contributions = sheets["contributions"].nlargest(5, "share of the variance")
plt.pie(contributions["share of the variance"], labels=contributions["input"])
