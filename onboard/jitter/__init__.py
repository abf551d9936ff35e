"""How well this machine keeps the tick: its own loop measured, beside a bare one."""
