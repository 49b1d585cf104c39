"""Tables: CSV, Parquet, TDMS."""
