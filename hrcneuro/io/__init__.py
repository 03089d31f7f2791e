"""The only reader and writer of FIF and Parquet artifacts; units are checked at the door."""
