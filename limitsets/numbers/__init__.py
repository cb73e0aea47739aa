"""Numbers that are not floats, intervals and their derivatives, and the compiler of kernels."""
