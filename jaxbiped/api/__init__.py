"""What sweep scripts are written with: studies, their results, and single missions."""
