"""`onboard jitter`: measures how well this machine keeps the tick, with the daemon's own loop next to a bare one."""
