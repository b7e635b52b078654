"""The interface for sweep scripts: studies, their results, and single missions."""
