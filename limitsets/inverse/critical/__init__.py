"""Critical points with their derivatives, and scenes with given critical points."""
