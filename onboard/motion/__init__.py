"""Motion control: path to steering angles and wheel rates, and wheel odometry."""
