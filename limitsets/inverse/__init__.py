"""From the answer wanted to the scene: critical points with their derivatives, design, and design for a margin."""
