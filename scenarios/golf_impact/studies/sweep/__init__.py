"""`golf-impact sweep`: many impacts, their table and picture."""
