"""Critical points with their derivatives, and scenes in which they are where they are wanted."""
