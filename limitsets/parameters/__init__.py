"""What varies: margins, noise, certified regions, the atlas, continuation, design, fits, and all answers in turn."""
