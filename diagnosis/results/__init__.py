"""The report document: result, assessment, loss of effectiveness."""
