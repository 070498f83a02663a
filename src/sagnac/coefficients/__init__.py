"""Q, N, B, K and R: their laws, and what a curve or a spectrum says of each."""
