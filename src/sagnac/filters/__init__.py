"""Settings of navigation filters: a state-space model of a gyro's noise, and files of tools."""
