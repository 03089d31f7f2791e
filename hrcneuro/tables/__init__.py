"""What the stages' tables hold: schemas, rows, units."""
