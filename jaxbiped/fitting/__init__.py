"""The ray-cast sensor fitted to rendered stereo pairs, and what two sensors see in the same places."""
